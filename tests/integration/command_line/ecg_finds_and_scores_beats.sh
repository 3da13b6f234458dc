#!/bin/sh
# perimap ecg: beats of a table and of a recording found and scored; what is wrong is named, with the right exit code.
set -eu
perimap=$1
data=$2
recording=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$perimap" ecg "$data/100_60s.csv" --beats "$work/beats.csv" --reference "$data/100_60s_beats.csv" --json > "$work/score.json"
[ "$(head -n 1 "$work/beats.csv")" = time_s,class,confidence,detected_at_s ]
[ "$(tail -n +2 "$work/beats.csv" | wc -l)" -eq "$(tail -n +2 "$data/100_60s_beats.csv" | wc -l)" ]
grep -q '"f1_percent": 100.0' "$work/score.json"

# The same by rate, from values alone in other units.
cut -d, -f2 "$data/100_60s.csv" > "$work/alone.csv"
"$perimap" ecg "$work/alone.csv" --rate 360 --gain 0.001 --beats "$work/alone_beats.csv" > /dev/null
[ "$(wc -l < "$work/alone_beats.csv")" -eq "$(wc -l < "$work/beats.csv")" ]

# The ECG of a recording: 6 s of a regular heart.
"$perimap" ecg "$recording" --beats "$work/recorded.csv" --json > "$work/recorded.json"
beats=$(tail -n +2 "$work/recorded.csv" | wc -l)
[ "$beats" -ge 5 ] && [ "$beats" -le 9 ] || { echo "$beats beats in 6 s"; exit 1; }
grep -q '"unusable_s": 0.0' "$work/recorded.json"

expect() {  # EXIT_CODE PATTERN ARGUMENT...
  code=$1 pattern=$2
  shift 2
  got=0
  "$perimap" ecg "$@" > "$work/out" 2>&1 || got=$?
  [ "$got" -eq "$code" ] && grep -q -e "$pattern" "$work/out" || { echo "perimap ecg $*: $got"; cat "$work/out"; exit 1; }
}
printf 'time_s,mV\n0,1\n0.1,x\n' > "$work/garbled.csv"
expect 1 'garbled.csv:3:5: expected a number' "$work/garbled.csv"
expect 1 'nothing.csv' "$work/nothing.csv"
expect 1 'say --rate' "$work/alone.csv"
expect 1 'alone.csv: 2000 samples a second; from 100 to 1000 are taken' "$work/alone.csv" --rate 2000
expect 1 'no WFDB\|nothing.hea' "$work/nothing.hea"
head -c 100000 "$recording" > "$work/cut.mcap"
expect 1 'cut.mcap: byte 100000: .*cut off' "$work/cut.mcap"
expect 1 'nothing.mcap' "$work/nothing.mcap"
expect 2 'knows its rate' "$recording" --rate 360
expect 2 'knows its rate' "$work/record.hea" --rate 360
expect 1 'reference' "$data/100_60s.csv" --reference "$work/nothing.csv"
expect 2 'rate' "$data/100_60s.csv" --rate fast
expect 2 'gain' "$data/100_60s.csv" --gain 0
expect 2 'INPUT' 
