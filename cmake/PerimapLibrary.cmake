# perimap_library(NAME FOLDER [SOURCES f...] [DEPENDS target...] [PRIVATE_DEPENDS target...])
#
# One target per folder. Headers are included by their path from the project's root ("core/time/instant.hpp"), but a
# target sees a folder's headers only when it depends on that folder's target: each target carries an include root of
# its own that holds nothing but its folder. So an include against the direction of the architecture does not build.
function(perimap_library NAME FOLDER)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(root ${CMAKE_BINARY_DIR}/include_roots/${NAME})
  get_filename_component(parent ${root}/${FOLDER} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${FOLDER} ${root}/${FOLDER} SYMBOLIC)
  if(ARG_SOURCES)
    add_library(${NAME} STATIC ${ARG_SOURCES})
    target_include_directories(${NAME} PUBLIC ${root})
    target_link_libraries(${NAME} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_PRIVATE_DEPENDS} perimap_warnings)
  else()
    add_library(${NAME} INTERFACE)
    target_include_directories(${NAME} INTERFACE ${root})
    target_link_libraries(${NAME} INTERFACE ${ARG_DEPENDS})
  endif()
endfunction()

# perimap_test(NAME SOURCES f... DEPENDS target... [LABELS l...])
#
# A GoogleTest program whose cases CTest lists one by one. Test data is found through PERIMAP_TEST_DATA.
function(perimap_test NAME)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;LABELS" ${ARGN})
  add_executable(${NAME} ${ARG_SOURCES})
  target_link_libraries(${NAME} PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main perimap_warnings)
  target_precompile_headers(${NAME} REUSE_FROM test_prelude)
  target_compile_definitions(${NAME} PRIVATE PERIMAP_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  gtest_discover_tests(${NAME} TEST_PREFIX "${NAME}." DISCOVERY_TIMEOUT 60 PROPERTIES LABELS "${ARG_LABELS}")
endfunction()
