#!/bin/bash
# clang_tidy_families.sh CLANG_TIDY CONFIGURATION: every family that the configuration names matches checks, and finds the
# fault planted for it in clang_tidy_faults/FAMILY.cpp, whose first line names the check that must speak. A family whose
# name is mistyped matches nothing, and clang-tidy would not say so.
clang_tidy=$1
configuration=$2
faults=$(dirname "$0")/clang_tidy_faults
failed=0
fail() {
  echo "$*" >&2
  failed=1
}

families=$(sed -n 's/^ *\([a-z]*\)-\*,\{0,1\}$/\1/p' "$configuration")
expected='bugprone cert concurrency cppcoreguidelines misc modernize performance readability'
if [ "$(echo $families)" != "$expected" ]; then fail "families are: $(echo $families); expected: $expected"; fi

checks=$("$clang_tidy" --config-file="$configuration" --list-checks)
for family in $families; do
  if ! grep -q "^ *$family-" <<< "$checks"; then fail "family $family matches no check"; fi
  fault=$faults/$family.cpp
  check=$(sed -n '1s|^// \([a-z0-9.-]*\)$|\1|p' "$fault")
  if [[ $check != "$family"-* ]]; then
    fail "$fault: the first line must name a check of its family"
    continue
  fi
  output=$("$clang_tidy" --config-file="$configuration" --quiet "$fault" -- -std=c++20 2>&1)
  status=$?
  if ! grep -q "error: .*\[.*$check" <<< "$output"; then fail "$check does not find its fault in $fault: $output"; fi
  if [ $status -eq 0 ]; then fail "$fault: clang-tidy reports success"; fi
done

output=$("$clang_tidy" --config-file="$configuration" --quiet "$faults/none.cpp" -- -std=c++20 2>&1)
if [ $? -ne 0 ] || grep -q 'error:\|warning:' <<< "$output"; then fail "none.cpp has no fault, but: $output"; fi
exit $failed
