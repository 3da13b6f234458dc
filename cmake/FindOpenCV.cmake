# find_package(OpenCV COMPONENTS core ...) without OpenCV's own package configuration, which Debian ships in
# libopencv-dev alone together with every module; the packages of single modules have just headers and libraries.
# Defines a target opencv_<component> for each component.
include(FindPackageHandleStandardArgs)

find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
set(OpenCV_required OpenCV_INCLUDE_DIR)
foreach(component ${OpenCV_FIND_COMPONENTS})
  find_library(OpenCV_${component}_LIBRARY opencv_${component})
  list(APPEND OpenCV_required OpenCV_${component}_LIBRARY)
endforeach()
find_package_handle_standard_args(OpenCV REQUIRED_VARS ${OpenCV_required})

foreach(component ${OpenCV_FIND_COMPONENTS})
  if(OpenCV_FOUND AND NOT TARGET opencv_${component})
    add_library(opencv_${component} UNKNOWN IMPORTED)
    set_target_properties(opencv_${component} PROPERTIES
      IMPORTED_LOCATION ${OpenCV_${component}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${OpenCV_INCLUDE_DIR})
  endif()
endforeach()
