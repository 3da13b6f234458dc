#!/bin/bash
# core_includes_nothing_of_the_outside.sh FOLDER: no DDS, device, file, logging or configuration header in it.
outside='dds/|spdlog/|toml\+\+/|CLI/|nlohmann/|yaml-cpp/|zstd\.h|linux/|sys/socket\.h|termios\.h|fstream|filesystem'
search() { grep -rnE "^[[:space:]]*#[[:space:]]*include[[:space:]]*[\"<]($outside)" "$1"; }

planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
printf '#include <vector>\n' > "$planted/a.hpp"
if search "$planted"; then echo "a sound file was refused" >&2; exit 1; fi
printf '#include <dds/dds.h>\n' > "$planted/a.hpp"
if ! search "$planted" > /dev/null; then echo "a planted include was not noticed" >&2; exit 1; fi

if search "$1"; then
  echo "core must not include these" >&2
  exit 1
fi
