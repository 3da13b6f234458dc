#!/bin/bash
# long_cmake_lines.sh ROOT: no line of a CMake list is longer than the 120 columns that clang-format leaves sources.
cd "$1" || exit 1
mapfile -t lists < <(find . \( -name build -o -name .git \) -prune -o -type f \( -name CMakeLists.txt -o -name '*.cmake' \) -print | sort)
[ ${#lists[@]} -gt 0 ] || { echo "no CMake lists below $1" >&2; exit 1; }
if ! awk 'length > 120 { printf "%s:%d: %d columns\n", FILENAME, FNR, length; long = 1 } END { exit long }' "${lists[@]}" >&2; then
  exit 1
fi
