# Third-party packages as interface targets whose headers are SYSTEM, so that our warning flags stay ours.
function(pv_third_party NAME)
  cmake_parse_arguments(ARG "" "" "INCLUDES;LIBRARIES" ${ARGN})
  add_library(pv_3rd_${NAME} INTERFACE)
  add_library(pv::${NAME} ALIAS pv_3rd_${NAME})
  target_include_directories(pv_3rd_${NAME} SYSTEM INTERFACE ${ARG_INCLUDES})
  target_link_libraries(pv_3rd_${NAME} INTERFACE ${ARG_LIBRARIES})
endfunction()

pv_third_party(eigen LIBRARIES Eigen3::Eigen)
pv_third_party(opencv INCLUDES ${OpenCV_INCLUDE_DIRS} LIBRARIES ${OpenCV_LIBS})
pv_third_party(ceres LIBRARIES Ceres::ceres)
# PCL_LIBRARIES would pull in VTK and Qt through pcl_io's exported dependencies.
pv_third_party(pcl INCLUDES ${PCL_INCLUDE_DIRS} LIBRARIES pcl_common pcl_filters pcl_io pcl_search pcl_kdtree pcl_sample_consensus
  pcl_surface)
pv_third_party(octomap INCLUDES ${OCTOMAP_INCLUDE_DIRS} LIBRARIES ${OCTOMAP_LIBRARIES})
pv_third_party(yaml LIBRARIES yaml-cpp)
pv_third_party(json LIBRARIES nlohmann_json::nlohmann_json)
pv_third_party(cli LIBRARIES CLI11::CLI11)
pv_third_party(embree LIBRARIES embree)
pv_third_party(zlib LIBRARIES ZLIB::ZLIB)
pv_third_party(zstd LIBRARIES PkgConfig::zstd)
pv_third_party(rosbag INCLUDES ${catkin_INCLUDE_DIRS} LIBRARIES ${rosbag_storage_LIBRARIES} rostime cpp_common roscpp_serialization)
pv_third_party(ros INCLUDES ${catkin_INCLUDE_DIRS} LIBRARIES ${catkin_LIBRARIES})
