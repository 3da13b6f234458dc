# Language level, warnings and sanitizers of every target of the project.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

# -ffp-contract=off: a result must not depend on which instructions the compiler fuses, because lockstep replay is
# compared byte for byte and golden vectors to 1e-9.
add_compile_options(-ffp-contract=off)

if(PERIMAP_ASSERTIONS)
  string(REPLACE "-DNDEBUG" "" CMAKE_CXX_FLAGS_RELWITHDEBINFO "${CMAKE_CXX_FLAGS_RELWITHDEBINFO}")
  # Light debug information: full -g triples the build time of the Eigen-heavy files.
  string(REPLACE "-g" "-g1" CMAKE_CXX_FLAGS_RELWITHDEBINFO "${CMAKE_CXX_FLAGS_RELWITHDEBINFO}")
endif()

# The same optimisation in every preset; the inner loops that gain from -O3 ask for it themselves.
string(REPLACE "-O3" "-O2" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
if(PERIMAP_SANITIZE)
  # -O1: instrumented Eigen code takes several times as long to compile at -O2 and hardly runs faster.
  string(REPLACE "-O2" "-O1" CMAKE_CXX_FLAGS_RELWITHDEBINFO "${CMAKE_CXX_FLAGS_RELWITHDEBINFO}")
  add_compile_options(-fsanitize=${PERIMAP_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  # Their runtimes call dlopen() in the program's place, so that glibc looks at their run path; at a program's DT_RPATH,
  # the older tag, it looks for whoever calls.
  add_link_options(-fsanitize=${PERIMAP_SANITIZE} LINKER:--disable-new-dtags)
endif()
# Compilers name the sanitizers in different ways.
if(PERIMAP_SANITIZE OR PERIMAP_FUZZ)
  add_compile_definitions(PERIMAP_SANITIZER)
  if(PERIMAP_FUZZ OR PERIMAP_SANITIZE MATCHES address)
    add_compile_definitions(PERIMAP_ADDRESS_SANITIZER)
  endif()
endif()
# gold, a part of binutils, links in half of the time that its elder brother takes.
if(CMAKE_BUILD_TYPE STREQUAL RelWithDebInfo AND PROJECT_IS_TOP_LEVEL AND NOT PERIMAP_FUZZ)
  find_program(PERIMAP_GOLD ld.gold)
  if(PERIMAP_GOLD)
    add_link_options(-fuse-ld=gold)
  endif()
endif()
# For files whose checks, inlined, take longer to compile than all else: AddressSanitizer's are calls there.
set(PERIMAP_CALLED_CHECKS --param asan-instrumentation-with-call-threshold=0)
if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  set(PERIMAP_CALLED_CHECKS -mllvm -asan-instrumentation-with-call-threshold=0)
endif()
set(PERIMAP_UNDEFINED all CACHE STRING "Checks of UndefinedBehaviorSanitizer: all, or some")
if(PERIMAP_SANITIZE STREQUAL "address,undefined" AND PERIMAP_UNDEFINED STREQUAL some)
  # A third of the build time for what AddressSanitizer mostly traps as well.
  add_compile_options(-fno-sanitize=null,alignment,object-size,pointer-overflow,vptr)
endif()
if(PERIMAP_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

# Warnings, as errors unless it is a part of another project, for the project's own code only (generated code is not
# linked to this).
add_library(perimap_warnings INTERFACE)
target_compile_options(perimap_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast>
  $<$<BOOL:${PERIMAP_WARNINGS_AS_ERRORS}>:-Werror>)
# GCC 12's flow analysis reports uninitialised values inside Eigen's fixed-capacity types, at -O3 and with sanitizers,
# that are not there.
target_compile_options(perimap_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
