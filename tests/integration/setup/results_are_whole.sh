#!/bin/bash
# What a calibration writes is written whole or not at all: where one of its files cannot be, no file is changed.
# results_are_whole.sh PERIMAP WORK_FOLDER
set -euo pipefail
perimap=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
cd "$work"

fail() {
  echo "FAILED: $1"
  exit 1
}
# Two signals of one motion, the second 40 ms late.
for late in 0 0.04; do
  awk -v l="$late" 'BEGIN { print "t_s,value"; for (i = 0; i < 1500; ++i) { t = 0.02 * i; u = t - l
    printf "%.6f,%.6f\n", t, sin(2.1 * u) + 0.7 * sin(5.3 * u + 1) + 0.4 * sin(11 * u + 2) } }' > "signal$late.csv"
done
printf 'version = 1\n\n[tracker]\ntime_offset_ms = 1.0\n' > devices.toml
echo before > result.json
measure() { "$perimap" calibrate time --signal signal0.csv --signal signal0.04.csv --output result.json --configuration devices.toml "$@" > out 2> errors; }
unchanged() {
  grep -q '^time_offset_ms = 1.0$' devices.toml || fail "$1: the configuration is changed: $(cat devices.toml)"
  [ "$(cat result.json)" = before ] || fail "$1: the result is changed"
  [ "$(ls | grep -c '^devices\|^result')" = 2 ] || fail "$1: something is left behind: $(ls)"
}

measure --html nowhere/page.html && fail "a page in a folder that is not there is taken"
unchanged "no folder for the page"
# Found only when it is written.
mkdir page.html.new
touch page.html.new/in_the_way
measure --html page.html && fail "a page that cannot be written is taken"
grep -q 'page.html' errors || fail "the error does not name the page: $(cat errors)"
unchanged "the page cannot be written"
rm -r page.html.new
measure --html page.html || fail "what can be written is refused: $(cat out errors)"
grep -q '^time_offset_ms = -*[0-9.]*  # measured' devices.toml || fail "the configuration is not written: $(cat devices.toml)"
[ "$(ls | grep -c '^devices\|^result')" = 4 ] || fail "the ones before are not kept: $(ls)"

# A name is any bytes.
odd=$(printf 'signal\377.csv')
cp signal0.csv "$odd"
"$perimap" calibrate time --signal "$odd" --signal signal0.04.csv --json > odd.json || fail "a name that is no UTF-8 ends it"
grep -q '"made_from": "signal' odd.json || fail "it is not said what it was made from: $(cat odd.json)"
echo passed
