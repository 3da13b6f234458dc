#!/bin/bash
# `perimap experiment`: what it writes is there and whole, the same seed gives the same figures, and errors are said in one
# line with their exit code.
#   experiment_writes_its_files.sh PERIMAP FOLDER
set -uo pipefail
perimap=$1
out=$2
rm -rf "$out"

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

for number in 1 2; do
  for run in a b; do
    "$perimap" experiment $number --trials 2 --seed 7 --out "$out/$run" > "$out.table" 2> "$out.progress" ||
      fail "experiment $number: exit code $?"
  done
  [ "$(grep -cE '^(static EKF|EKF, Fourier|iterated|delayed|batch|Cramer-Rao)' "$out.table")" -eq 6 ] ||
    fail "experiment $number: not six methods in the table"
  grep -q '^100%' "$out.progress" || fail "experiment $number: no progress on standard error"
  for page in "$out/a/experiment-$number.html" "$out/a/experiment-$number.json" "$out/a/experiment-$number.csv"; do
    [ -s "$page" ] || fail "$page is missing"
  done
  grep -q '</svg>' "$out/a/experiment-$number.html" || fail "the page has no figure"
  if grep -oE '(src|href)=' "$out/a/experiment-$number.html"; then fail "the page refers to something outside"; fi
  pictures=0
  for picture in "$out/a/experiment-$number"-*.png; do
    [ "$(head -c 4 "$picture" | tail -c 3)" = PNG ] || fail "$picture is no PNG"
    pictures=$((pictures + 1))
  done
  [ $pictures -ge 2 ] || fail "experiment $number: $pictures pictures"
  for figures in "$out/a/experiment-$number"-*.csv; do
    cmp "$figures" "$out/b/$(basename "$figures")" || fail "the same seed gave other figures"
  done
  # All but the times, which stand last.
  cmp <(sed 's/,[^,]*$//' "$out/a/experiment-$number.csv") <(sed 's/,[^,]*$//' "$out/b/experiment-$number.csv") ||
    fail "the same seed gave another table"
done

expect() { # EXIT_CODE ARGUMENT...
  local code=$1
  shift
  "$perimap" experiment "$@" > /dev/null 2> "$out.error"
  local got=$?
  [ $got -eq "$code" ] || fail "'experiment $*' ended with $got in place of $code"
}
expect 2 4
expect 2 1 --trials 0
expect 2 1 --no-such-option
expect 2
touch "$out/file"
expect 1 1 --trials 1 --out "$out/file"
grep -q "^perimap experiment: .*$out/file" "$out.error" || fail "the error does not name the folder"
