# perimap_fuzzer(NAME SOURCES f... DEPENDS target...)
#
# A libFuzzer program (preset "fuzz"). Run it as NAME -max_total_time=60 WORK_FOLDER tests/fuzz/corpus/...
function(perimap_fuzzer NAME)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${NAME} ${ARG_SOURCES})
  target_link_libraries(${NAME} PRIVATE ${ARG_DEPENDS} perimap_warnings)
  target_link_options(${NAME} PRIVATE -fsanitize=fuzzer)
endfunction()
