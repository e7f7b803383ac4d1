# This package as catkin's: messages, devel space, planar_vslamConfig.cmake for who finds it.

# ROS's Python modules belong to the system's interpreter; another one may come first on PATH.
if(EXISTS /usr/bin/python3)
  set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Interpreter catkin uses")
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Interpreter ament uses")
endif()

# catkin snapshots the test environment at configure time and skips folders that do not exist yet.
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/devel/lib/python3/dist-packages)
find_package(catkin REQUIRED COMPONENTS
  roscpp std_msgs std_srvs geometry_msgs sensor_msgs nav_msgs map_msgs diagnostic_msgs visualization_msgs
  actionlib move_base_msgs tf2 tf2_ros tf2_msgs image_transport nodelet pluginlib rosbag_storage dynamic_reconfigure
  message_generation)
add_message_files(FILES Event.msg State.msg)
add_service_files(FILES LoadMap.srv SaveMap.srv SetMode.srv)
generate_messages(DEPENDENCIES std_msgs)
generate_dynamic_reconfigure_options(cfg/Slam.cfg)
catkin_package(
  INCLUDE_DIRS include planar/include mapping2d/include
  CATKIN_DEPENDS message_runtime  # of our own; the libraries bring the rest of what they need in ThirdParty.cmake
  CFG_EXTRAS planar_vslam-extras.cmake)

set(pv_config_dir ${CATKIN_DEVEL_PREFIX}/share/planar_vslam/cmake)
set(pv_bag_files pv::rosbag pv::sqlite pv::lz4 pv::zstd)
set(PLANAR_VSLAM_TESTS ${CATKIN_ENABLE_TESTING})
