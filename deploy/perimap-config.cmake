# find_package(perimap [COMPONENTS client core]) gives
# perimap::client the C types of perimap.idl, perimap_mesh.idl and perimap_tool.idl, made by Cyclone DDS' compiler for
#                    the project that asks,
#                    with perimap_client.hpp, perimap_mesh_client.hpp, perimap_publisher_watch.hpp,
#                    perimap_tool_client.hpp and perimap_use.hpp;
#                    the project's languages must be C and CXX
# perimap::core what perimapd computes with, without devices, files and DDS; its parts are perimap::core_phase and so on
# A component that is named must be there. Without names: each whose own dependencies are installed.
foreach(part client core)
  set(perimap_${part}_lacks "")
endforeach()

find_package(CycloneDDS QUIET)
if(NOT CycloneDDS_FOUND)
  set(perimap_client_lacks "CycloneDDS")
elseif(NOT TARGET perimap::client)
  get_filename_component(perimap_data ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
  idlc_generate(TARGET perimap_client FILES ${perimap_data}/perimap.idl ${perimap_data}/perimap_mesh.idl
    ${perimap_data}/perimap_tool.idl)
  find_path(perimap_INCLUDE_DIR perimap_client.hpp HINTS ${perimap_data}/../../include REQUIRED)
  target_include_directories(perimap_client INTERFACE ${perimap_INCLUDE_DIR})
  target_link_libraries(perimap_client INTERFACE CycloneDDS::ddsc)
  add_library(perimap::client ALIAS perimap_client)
endif()

# OpenCV is found by the module beside this file: Debian ships OpenCV's own configuration with all of its modules only.
set(perimap_module_path ${CMAKE_MODULE_PATH})
list(PREPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})
find_package(Eigen3 QUIET NO_MODULE)
find_package(hwy QUIET)
find_package(tl-expected QUIET)
find_package(Boost QUIET)
find_package(OpenCV QUIET COMPONENTS core imgproc)
set(CMAKE_MODULE_PATH ${perimap_module_path})
foreach(package Eigen3 hwy tl-expected Boost OpenCV)
  if(NOT ${package}_FOUND)
    list(APPEND perimap_core_lacks ${package})
  endif()
endforeach()
if(NOT perimap_core_lacks AND NOT TARGET perimap::core)
  include(${CMAKE_CURRENT_LIST_DIR}/perimap-core.cmake)
endif()

set(perimap_NOT_FOUND_MESSAGE "")
foreach(part client core)
  set(perimap_${part}_FOUND ON)
  if(perimap_${part}_lacks)
    set(perimap_${part}_FOUND OFF)
    string(APPEND perimap_NOT_FOUND_MESSAGE
      "perimap::${part} needs packages that are not found: ${perimap_${part}_lacks}. ")
  endif()
endforeach()
foreach(part IN LISTS perimap_FIND_COMPONENTS)
  if(NOT part MATCHES "^(client|core)$")
    set(perimap_FOUND OFF)
    string(APPEND perimap_NOT_FOUND_MESSAGE "There is no component ${part}: client, core. ")
  elseif(perimap_FIND_REQUIRED_${part} AND NOT perimap_${part}_FOUND)
    set(perimap_FOUND OFF)
  endif()
endforeach()
if(NOT perimap_client_FOUND AND NOT perimap_core_FOUND)
  set(perimap_FOUND OFF)
elseif(NOT perimap_FIND_COMPONENTS AND perimap_NOT_FOUND_MESSAGE AND NOT perimap_FIND_QUIETLY)
  message(STATUS "${perimap_NOT_FOUND_MESSAGE}")
endif()
