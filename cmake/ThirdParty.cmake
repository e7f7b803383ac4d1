# What the libraries link against, as targets pv::NAME. They are IMPORTED, so their headers are SYSTEM and our warning
# flags stay ours. Read by this build and, installed, by planar_vslamConfig.cmake: static libraries need the same again.
include(CMakeFindDependencyMacro)

# find_package for both readers: a build stops where something is missing, a config file says that it is not found.
macro(pv_find)
  if(CMAKE_FIND_PACKAGE_NAME)
    find_dependency(${ARGN})
  else()
    find_package(${ARGN} REQUIRED)
  endif()
endmacro()

function(pv_third_party NAME)
  cmake_parse_arguments(ARG "" "" "INCLUDES;LIBRARIES" ${ARGN})
  if(NOT TARGET pv::${NAME})
    add_library(pv::${NAME} INTERFACE IMPORTED)
    set_target_properties(pv::${NAME} PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${ARG_INCLUDES}" INTERFACE_LINK_LIBRARIES "${ARG_LIBRARIES}")
  endif()
endfunction()

pv_find(Eigen3)
pv_third_party(eigen LIBRARIES Eigen3::Eigen)
pv_find(Ceres)
pv_third_party(ceres LIBRARIES Ceres::ceres)
pv_find(OpenCV COMPONENTS core imgproc features2d calib3d)
pv_third_party(opencv INCLUDES ${OpenCV_INCLUDE_DIRS} LIBRARIES ${OpenCV_LIBS})
pv_find(octomap)
pv_third_party(octomap INCLUDES ${OCTOMAP_INCLUDE_DIRS} LIBRARIES ${OCTOMAP_LIBRARIES})
pv_find(yaml-cpp)
pv_third_party(yaml LIBRARIES yaml-cpp)
pv_find(fmt)
pv_find(Threads)
pv_find(JPEG)
pv_third_party(jpeg LIBRARIES JPEG::JPEG)
pv_find(PNG)
pv_third_party(png LIBRARIES PNG::PNG)
pv_find(ZLIB)
pv_third_party(zlib LIBRARIES ZLIB::ZLIB)

# Linked by file. Only this build needs the headers and so their own configs: that of PCL finds VTK and Qt and wants C for
# it, that of rosbag_storage finds catkin and ament and wants their Python.
if(NOT CMAKE_FIND_PACKAGE_NAME)
  find_package(PCL REQUIRED COMPONENTS common filters io surface)
endif()
function(pv_third_party_files NAME)
  cmake_parse_arguments(ARG "" "" "INCLUDES;LIBRARIES" ${ARGN})
  set(files)
  foreach(library ${ARG_LIBRARIES})
    find_library(PV_${library}_LIBRARY ${library} REQUIRED)
    list(APPEND files ${PV_${library}_LIBRARY})
  endforeach()
  pv_third_party(${NAME} INCLUDES ${ARG_INCLUDES} LIBRARIES ${files})
endfunction()
pv_third_party_files(zstd LIBRARIES zstd)
pv_third_party_files(pcl INCLUDES ${PCL_INCLUDE_DIRS} LIBRARIES pcl_common pcl_filters pcl_io pcl_search pcl_kdtree
  pcl_sample_consensus pcl_surface)
if(PLANAR_VSLAM_ROS)  # bags and messages, without a running ROS
  pv_third_party_files(rosbag INCLUDES ${catkin_INCLUDE_DIRS} LIBRARIES rosbag_storage roscpp_serialization rostime
    cpp_common class_loader console_bridge)
  pv_third_party_files(sqlite LIBRARIES sqlite3)
  pv_third_party_files(lz4 LIBRARIES lz4)
endif()
