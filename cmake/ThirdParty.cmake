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
pv_find(OpenCV COMPONENTS core imgproc imgcodecs features2d calib3d)
pv_third_party(opencv INCLUDES ${OpenCV_INCLUDE_DIRS} LIBRARIES ${OpenCV_LIBS})
pv_find(octomap)
pv_third_party(octomap INCLUDES ${OCTOMAP_INCLUDE_DIRS} LIBRARIES ${OCTOMAP_LIBRARIES})
pv_find(yaml-cpp)
pv_third_party(yaml LIBRARIES yaml-cpp)
pv_find(fmt)
pv_find(Threads)
pv_find(ZLIB)
pv_third_party(zlib LIBRARIES ZLIB::ZLIB)
find_library(PV_ZSTD_LIBRARY zstd REQUIRED)
pv_third_party(zstd LIBRARIES ${PV_ZSTD_LIBRARY})

# Linked by file: PCL_LIBRARIES would pull in VTK and Qt. PCL's own config is for those who compile with its headers
# (it looks for VTK, which wants the language C).
if(NOT CMAKE_FIND_PACKAGE_NAME)
  find_package(PCL REQUIRED COMPONENTS common filters io surface)
endif()
set(pv_pcl_libraries)
foreach(part common filters io search kdtree sample_consensus surface)
  find_library(PV_PCL_${part}_LIBRARY pcl_${part} REQUIRED)
  list(APPEND pv_pcl_libraries ${PV_PCL_${part}_LIBRARY})
endforeach()
pv_third_party(pcl INCLUDES ${PCL_INCLUDE_DIRS} LIBRARIES ${pv_pcl_libraries})

# Bags, without a running ROS; catkin_INCLUDE_DIRS has the messages.
if(PLANAR_VSLAM_ROS)
  set(pv_rosbag_libraries)
  foreach(package rosbag_storage roscpp_serialization rostime cpp_common)
    pv_find(${package})
    list(APPEND pv_rosbag_libraries ${${package}_LIBRARIES})
  endforeach()
  list(REMOVE_DUPLICATES pv_rosbag_libraries)
  pv_third_party(rosbag INCLUDES ${rosbag_storage_INCLUDE_DIRS} ${catkin_INCLUDE_DIRS} LIBRARIES ${pv_rosbag_libraries})
endif()
