# Instruments everything compiled here; third-party libraries stay as they are. Included before the first target.
set(PLANAR_VSLAM_SANITIZE "" CACHE STRING "Sanitizer of all targets: thread, or address (with undefined); empty: none")
set_property(CACHE PLANAR_VSLAM_SANITIZE PROPERTY STRINGS "" thread address)
set(pv_sanitizers_thread thread)
set(pv_sanitizers_address address,undefined)
if(PLANAR_VSLAM_SANITIZE)
  if(NOT DEFINED pv_sanitizers_${PLANAR_VSLAM_SANITIZE})
    message(FATAL_ERROR "PLANAR_VSLAM_SANITIZE is '${PLANAR_VSLAM_SANITIZE}'; expected thread, address or nothing")
  endif()
  set(pv_sanitizer_flag -fsanitize=${pv_sanitizers_${PLANAR_VSLAM_SANITIZE}})
  # Lines are all that a finding names; with types and variables (-g) a build takes 7 GB instead of 2.
  add_compile_options(${pv_sanitizer_flag} -fno-sanitize-recover=all -g1 -O1 -fno-omit-frame-pointer)
  # Eigen allocates in its own way under AddressSanitizer, but PCL and Ceres are not built so and free what we allocate.
  add_compile_definitions(_GLIBCXX_ASSERTIONS EIGEN_MALLOC_ALREADY_ALIGNED=1)
  add_link_options(${pv_sanitizer_flag})
endif()

# Line coverage for scripts/coverage.
option(PLANAR_VSLAM_COVERAGE "Count the lines that tests run" OFF)
if(PLANAR_VSLAM_COVERAGE)
  add_compile_options(--coverage -O1)
  add_link_options(--coverage)
endif()
