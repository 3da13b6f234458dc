#!/bin/bash
# hazards_without_tests_are_noticed.sh: check_hazards.sh passes a table whose tests are there, and names each row whose
# tests are not.
set -uo pipefail
check=$(cd "$(dirname "$0")" && pwd)/check_hazards.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
status=0
mkdir -p "$work/docs/design" "$work/tests/unit"
echo 'TEST_F(Suite, Name) {}' > "$work/tests/unit/a_test.cpp"
printf '// TEST(Commented, Name) {}\nTEST(Disabled, DISABLED_Name) {}\n' >> "$work/tests/unit/a_test.cpp"
echo 'TEST(Other, Name) {}' > "$work/tests/unit/unbuilt_test.cpp"
echo 'perimap_test(unit_a SOURCES a_test.cpp)' > "$work/tests/unit/CMakeLists.txt"

tried() { # TESTS EXPECTED: a table with one row that names these; empty: passes
  printf '# Hazards\n\n| hazard | cause | effect | control | tests |\n|---|---|---|---|---|\n| H1 x | c | e | k | %s |\n' \
    "$1" > "$work/docs/design/hazards.md"
  if bash "$check" "$work" > "$work/out" 2>&1; then
    [ -z "$2" ] || { echo "FAILED: not noticed: $1"; status=1; }
  elif [ -z "$2" ] || ! grep -qF "docs/design/hazards.md:5: $2" "$work/out"; then
    echo "FAILED: of '$1' expected '$2', got: $(cat "$work/out")"
    status=1
  fi
}
tried '`tests/unit/a_test.cpp`' ''
tried '`tests/unit/a_test.cpp: Suite`, `tests/unit/a_test.cpp: Suite.Name`' ''
tried 'none' 'this hazard names no test'
tried '`tests/unit/gone_test.cpp`' 'there is no test tests/unit/gone_test.cpp'
tried '`tests/unit/unbuilt_test.cpp`' 'nothing makes a test of tests/unit/unbuilt_test.cpp'
tried '`tests/unit/a_test.cpp: Suite.Gone`' 'tests/unit/a_test.cpp has no test Suite.Gone'
tried '`tests/unit/a_test.cpp: Gone`' 'tests/unit/a_test.cpp has no tests of Gone'
tried '`tests/unit/a_test.cpp: Commented.Name`' 'tests/unit/a_test.cpp has no test Commented.Name'
tried '`tests/unit/a_test.cpp: Disabled`' 'tests/unit/a_test.cpp has no tests of Disabled'
printf '# Hazards\n' > "$work/docs/design/hazards.md"
bash "$check" "$work" > "$work/out" 2>&1 && { echo 'FAILED: an empty table passes'; status=1; }
exit $status
