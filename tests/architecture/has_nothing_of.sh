#!/bin/bash
# has_nothing_of.sh PROGRAM ANOTHER LIBRARY...: no function that one of the static libraries defines is in PROGRAM, which
# must have its symbols; of each there are some in ANOTHER program, or this would prove nothing.
program=$1
another=$2
shift 2
functions() { nm --defined-only "$1" 2> /dev/null | awk '$2 == "T" { print $3 }' | sort -u; }

in_program=$(functions "$program")
in_another=$(functions "$another")
[ -n "$in_program" ] || { echo "$program has no symbols" >&2; exit 1; }
failed=0
for library in "$@"; do
  of_library=$(functions "$library")
  found=$(comm -12 <(echo "$of_library") <(echo "$in_program") | grep -v '^$')
  if [ -n "$found" ]; then
    echo "$program has what $library defines:" >&2
    echo "$found" | head -5 | c++filt >&2
    failed=1
  fi
  if [ -z "$(comm -12 <(echo "$of_library") <(echo "$in_another") | grep -v '^$')" ]; then
    echo "$another has nothing of $library" >&2
    failed=1
  fi
done
exit $failed
