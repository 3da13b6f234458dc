#!/bin/bash
# core_is_part_of_another_project.sh SOURCE_FOLDER RECORD WORK_FOLDER: a project builds perimap's core by add_subdirectory,
# without programs and tests, and its program runs.
set -uo pipefail
source=$1 record=$2 work=$3
. "$(dirname "$0")/phase_of_record.sh"
fail() {
  echo "FAILED: $1"
  exit 1
}
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$work"
mkdir -p "$work"
{ cmake -S "$here/subproject" -B "$work/build" -DPERIMAP_SOURCE="$source" && cmake --build "$work/build"; } > "$work/log" 2>&1 ||
  fail "$(tail -n 30 "$work/log")"
cd "$work" && phase_of_record build/heart_phase/heart_phase "$record" || fail "the phases are wrong"
for nobody_asked in libcore_vision.a perimapd; do
  if [ -n "$(find build -name "$nobody_asked")" ]; then fail "$nobody_asked was built, which the program does not need"; fi
done
