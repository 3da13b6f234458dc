# find_package(perimap) gives perimap::client: the C types of perimap.idl, made by Cyclone DDS' compiler for the project that
# asks, and perimap_client.hpp. The project's languages must be C and CXX.
include(CMakeFindDependencyMacro)
find_dependency(CycloneDDS)
if(NOT TARGET perimap::client)
  get_filename_component(perimap_data ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
  idlc_generate(TARGET perimap_client FILES ${perimap_data}/perimap.idl)
  find_path(perimap_INCLUDE_DIR perimap_client.hpp HINTS ${perimap_data}/../../include REQUIRED)
  target_include_directories(perimap_client INTERFACE ${perimap_INCLUDE_DIR})
  target_link_libraries(perimap_client INTERFACE CycloneDDS::ddsc)
  add_library(perimap::client ALIAS perimap_client)
endif()
