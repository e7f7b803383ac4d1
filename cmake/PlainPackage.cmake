# This package without ROS: the same folders, targets and config file, made without catkin.
include(CTest)
include(CMakePackageConfigHelpers)
set(PLANAR_VSLAM_TESTS ${BUILD_TESTING})
add_custom_target(tests)

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/devel/lib/planar_vslam)
set(pv_config_dir ${CMAKE_BINARY_DIR}/devel/share/planar_vslam/cmake)
configure_file(cmake/planar_vslamConfig.cmake.in ${pv_config_dir}/planar_vslamConfig.cmake @ONLY)
configure_file(cmake/planar_vslam-extras.cmake.in ${pv_config_dir}/planar_vslam-extras.cmake @ONLY)
write_basic_package_version_file(${pv_config_dir}/planar_vslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${pv_config_dir}/planar_vslamConfig.cmake ${pv_config_dir}/planar_vslam-extras.cmake
  ${pv_config_dir}/planar_vslamConfigVersion.cmake DESTINATION share/planar_vslam/cmake)

set(pv_bag_files WITHOUT "/(bag_[a-z_]*|odometry_messages|value_messages|tf_tree)\\.cpp$"
  SOURCES ${PROJECT_SOURCE_DIR}/src/io/without_ros/no_bags.cpp ${PROJECT_SOURCE_DIR}/src/io/bag_folder.cpp)
