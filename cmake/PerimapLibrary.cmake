# As little time as possible for a whole build, as tests/run.sh makes them. Daily work has better use for files that are
# compiled alone.
option(PERIMAP_TOGETHER "Compile files together where a target allows that" OFF)
option(PERIMAP_LONG "Build what only tests labelled `long` and statistics need" ON)

# perimap_library(NAME FOLDER [UNITY [ALONE f...]] [PRELUDE p] [SOURCES f...] [DEPENDS target...] [PRIVATE_DEPENDS
# target...])
#
# One target per folder. Headers are included by their path from the project's root ("core/time/instant.hpp"), but a
# target sees a folder's headers only when it depends on that folder's target: each target carries an include root of
# its own that holds nothing but its folder. So an include against the direction of the architecture does not build.
#
# PRELUDE names the precompiled headers (perimap_prelude) that its files begin with. UNITY: with PERIMAP_TOGETHER eight
# of its files are compiled as one, in four fifths to a half of the time; what is local to them must have different
# names then. ALONE: files whose local names stand for something else in others.
function(perimap_library NAME FOLDER)
  cmake_parse_arguments(ARG "UNITY" "PRELUDE" "ALONE;SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(root ${PROJECT_BINARY_DIR}/include_roots/${NAME})
  get_filename_component(parent ${root}/${FOLDER} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${FOLDER} ${root}/${FOLDER} SYMBOLIC)
  if(ARG_SOURCES)
    add_library(${NAME} STATIC ${ARG_SOURCES})
    target_include_directories(${NAME} PUBLIC $<BUILD_INTERFACE:${root}> $<INSTALL_INTERFACE:include/perimap>)
    target_compile_features(${NAME} PUBLIC cxx_std_20)
    target_link_libraries(${NAME} PUBLIC ${ARG_DEPENDS}
      PRIVATE ${ARG_PRIVATE_DEPENDS} $<BUILD_INTERFACE:perimap_warnings>)
    # What tests share is built for those that are built.
    if(FOLDER MATCHES "^tests/")
      set_target_properties(${NAME} PROPERTIES EXCLUDE_FROM_ALL ON)
    endif()
    if(ARG_PRELUDE AND TARGET ${ARG_PRELUDE})
      target_precompile_headers(${NAME} REUSE_FROM ${ARG_PRELUDE})
    endif()
    if(ARG_UNITY)
      set_target_properties(${NAME} PROPERTIES UNITY_BUILD ${PERIMAP_TOGETHER})
      if(ARG_ALONE)
        set_source_files_properties(${ARG_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
      endif()
    endif()
  else()
    add_library(${NAME} INTERFACE)
    target_include_directories(${NAME} INTERFACE $<BUILD_INTERFACE:${root}> $<INSTALL_INTERFACE:include/perimap>)
    target_compile_features(${NAME} INTERFACE cxx_std_20)
    target_link_libraries(${NAME} INTERFACE ${ARG_DEPENDS})
  endif()
  add_library(perimap::${NAME} ALIAS ${NAME})
  # For the tests of the architecture, which try every library.
  set_property(TARGET ${NAME} PROPERTY PERIMAP_FOLDER ${FOLDER})
  set_property(GLOBAL APPEND PROPERTY PERIMAP_LIBRARIES ${NAME})
endfunction()

# perimap_prelude(NAME [FOR_PROGRAMS] HEADERS <header>... DEPENDS target...)
#
# Headers of others that take longer to read than most files take to compile, read once for all. Not in release builds:
# there each file must compile with what it includes itself; nor inside another project. Programs are compiled with
# other flags than libraries.
function(perimap_prelude NAME)
  cmake_parse_arguments(ARG "FOR_PROGRAMS" "" "HEADERS;DEPENDS" ${ARGN})
  if(CMAKE_BUILD_TYPE STREQUAL RelWithDebInfo AND PROJECT_IS_TOP_LEVEL)
    if(ARG_FOR_PROGRAMS)
      add_executable(${NAME} ${PROJECT_SOURCE_DIR}/cmake/prelude.cpp)
    else()
      add_library(${NAME} OBJECT ${PROJECT_SOURCE_DIR}/cmake/prelude.cpp)
    endif()
    target_link_libraries(${NAME} PRIVATE ${ARG_DEPENDS} perimap_warnings)
    target_precompile_headers(${NAME} PRIVATE ${ARG_HEADERS})
  endif()
endfunction()

# perimap_test(NAME [UNITY [ALONE f...]] [OUTSIDE] [THREADS] [LONG] SOURCES f... DEPENDS target...)
#
# A GoogleTest program whose cases CTest lists one by one. Test data is found through PERIMAP_TEST_DATA. With
# PERIMAP_TOGETHER CTest runs each program in four parts instead: starting a program with a sanitizer and its libraries
# for each case takes longer than most cases. ALONE: as above.
#
# A quick tests/run.sh makes two builds. `outside`, under AddressSanitizer: the unit tests marked OUTSIDE, of what reads
# the bytes of others (files, devices, messages) and of the rings that they go through. `plain`: all the rest.
# `threads`, for ThreadSanitizer: the tests of whole programs, and the unit tests marked THREADS, in which more than one
# runs. Elsewhere PERIMAP_TESTS is `all`.
set(tests OFF)
if(PROJECT_IS_TOP_LEVEL)
  set(tests all)
endif()
set(PERIMAP_TESTS ${tests} CACHE STRING "Tests to build: all, plain, outside, threads, or OFF")
function(perimap_test NAME)
  cmake_parse_arguments(ARG "UNITY;OUTSIDE;THREADS;LONG" "" "ALONE;SOURCES;DEPENDS" ${ARGN})
  set(wanted ON)
  if((PERIMAP_TESTS STREQUAL plain AND ARG_OUTSIDE) OR (PERIMAP_TESTS STREQUAL outside AND NOT ARG_OUTSIDE))
    set(wanted OFF)
  elseif(PERIMAP_TESTS STREQUAL threads AND NOT ARG_THREADS)
    set(wanted OFF)
  endif()
  set(label "")
  if(ARG_LONG)
    set(label long)
    if(NOT PERIMAP_LONG)
      set(wanted OFF)
    endif()
  endif()
  add_executable(${NAME} ${ARG_SOURCES})
  if(NOT wanted)
    set_target_properties(${NAME} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  target_link_libraries(${NAME} PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main perimap_warnings)
  if(TARGET test_prelude)
    target_precompile_headers(${NAME} REUSE_FROM test_prelude)
  endif()
  if(ARG_UNITY)
    set_target_properties(${NAME} PROPERTIES UNITY_BUILD ${PERIMAP_TOGETHER})
    if(ARG_ALONE)
      set_source_files_properties(${ARG_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endif()
  target_compile_definitions(${NAME} PRIVATE PERIMAP_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/data")
  if(wanted AND PERIMAP_TOGETHER)
    foreach(part RANGE 3)
      add_test(NAME ${NAME}.part_${part} COMMAND ${NAME})
      set_tests_properties(${NAME}.part_${part} PROPERTIES
        ENVIRONMENT "GTEST_TOTAL_SHARDS=4;GTEST_SHARD_INDEX=${part}" LABELS "${label}" TIMEOUT 900)
    endforeach()
  elseif(wanted)
    gtest_discover_tests(${NAME} TEST_PREFIX "${NAME}." DISCOVERY_TIMEOUT 60 PROPERTIES LABELS "${label}")
  endif()
endfunction()

# perimap_test_program(NAME [LONG] SOURCES f... DEPENDS target...)
#
# A program that tests run, or that is one. LONG: only tests labelled `long` do; without PERIMAP_LONG it
# is not built.
function(perimap_test_program NAME)
  cmake_parse_arguments(ARG "LONG" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${NAME} ${ARG_SOURCES})
  target_link_libraries(${NAME} PRIVATE ${ARG_DEPENDS} perimap_warnings)
  if(TARGET test_prelude AND ARG_DEPENDS MATCHES GTest)
    target_precompile_headers(${NAME} REUSE_FROM test_prelude)
  endif()
  if(ARG_LONG AND NOT PERIMAP_LONG)
    set_target_properties(${NAME} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()
