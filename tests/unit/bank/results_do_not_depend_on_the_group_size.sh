#!/bin/bash
# What a bank computes does not depend on how many features make a group.
# results_do_not_depend_on_the_group_size.sh BANK_RESULTS BANK_RESULTS_IN_FOURS WORK_FOLDER
set -uo pipefail
work=$3
mkdir -p "$work"
"$1" > "$work/eight.txt" 2> "$work/eight.lanes" || exit 1
"$2" > "$work/four.txt" 2> "$work/four.lanes" || exit 1
grep -qx "8 lanes" "$work/eight.lanes" && grep -qx "4 lanes" "$work/four.lanes" || {
  echo "FAILED: groups of $(cat "$work"/*.lanes)"
  exit 1
}
# Groups are printed one after the other, so that the order of the lines is another.
sort "$work/eight.txt" > "$work/eight.sorted"
sort "$work/four.txt" > "$work/four.sorted"
[ "$(wc -l < "$work/eight.sorted")" -gt 10000 ] || {
  echo "FAILED: only $(wc -l < "$work/eight.sorted") lines"
  exit 1
}
cmp "$work/eight.sorted" "$work/four.sorted"
