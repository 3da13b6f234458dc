#!/bin/bash
# check_hazards.sh ROOT: each row of the table of docs/design/hazards.md names tests, and each of them is there.
#
#   - a file in backticks exists and is one that the build knows: named in a CMakeLists.txt of its folder or of one above
#   - `file: Suite.Name` is a test of that file, `file: Suite` a suite of it
#
# What it finds is printed as FILE:LINE: what; exit code 1 then.
set -uo pipefail
root=$(cd "$1" && pwd) || exit 2
cd "$root" || exit 2
table=docs/design/hazards.md
faults=0
fault() {
  echo "$1"
  faults=$((faults + 1))
}

# Named in the CMakeLists.txt that makes a test of it.
built() {
  local folder name
  folder=$(dirname "$1")
  name=$(basename "$1")
  while [ "$folder" != . ]; do
    if [ -e "$folder/CMakeLists.txt" ]; then
      grep -qF "$name" "$folder/CMakeLists.txt" && return 0
      # One program for each name of a list, as `foreach(name a b)` with `${name}_test.cpp`.
      local stem=${name%_test.cpp}
      [ "$stem" != "$name" ] && grep -qE "foreach\(.*\b$stem\b" "$folder/CMakeLists.txt" && return 0
      stem=${name%.sh}
      [ "$stem" != "$name" ] && grep -qE "\b$stem\b" "$folder/CMakeLists.txt" && return 0
    fi
    folder=$(dirname "$folder")
  done
  return 1
}

rows=0
while IFS=$'\t' read -r number tests; do
  rows=$((rows + 1))
  found=0
  while read -r named; do
    [ -n "$named" ] || continue
    found=$((found + 1))
    file=${named%%:*}
    what=${named#"$file"}
    what=${what#: }
    if [ ! -e "$file" ]; then
      fault "$table:$number: there is no test $file"
      continue
    fi
    built "$file" || fault "$table:$number: nothing makes a test of $file"
    [ -n "$what" ] || continue
    if [[ $what == *.* ]]; then
      grep -qE "^TEST(_F|_P)?\(${what%%.*}, ${what#*.}\)" "$file" || fault "$table:$number: $file has no test $what"
    else
      grep -E "^TEST(_F|_P)?\($what, " "$file" | grep -qv DISABLED_ || fault "$table:$number: $file has no tests of $what"
    fi
  done < <(grep -oE '`[^`]+`' <<< "$tests" | tr -d '\140')
  [ $found -gt 0 ] || fault "$table:$number: this hazard names no test"
done < <(awk -F'|' '/^\| H[0-9]+ / { print NR "\t" $6 }' "$table")

[ $rows -gt 0 ] || fault "$table:1: no row begins with a hazard's number (| H1 ...)"
if [ $faults -gt 0 ]; then
  echo "$faults faults in $rows hazards"
  exit 1
fi
echo "$rows hazards: each names tests that are there"
