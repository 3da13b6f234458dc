#!/bin/sh
# perimap ecg: a WFDB record by any of its names; what is whole of a recording that was cut off.
set -eu
perimap=$1
data=$2
recording=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "$1"; shift; cat "$@"; exit 1; }

# Record 100 as 16-bit numbers beside a lead that is flat: 200 a mV, 1024 at 0 mV.
printf '%b' "$(awk -F, 'NR > 1 && NR < 10802 { n = int($2 * 200 + 1024.5); printf "\\0%o\\0%o\\0000\\0004", n % 256, int(n / 256) }' \
  "$data/100_60s.csv")" > "$work/r100.dat"
[ "$(stat -c %s "$work/r100.dat")" -eq 43200 ] || fail "the record could not be written"
printf 'r100 2 360 10800\nr100.dat 16 200 16 1024\nr100.dat 16 200 16 1024\n' > "$work/r100.hea"
head -n 10801 "$data/100_60s.csv" > "$work/same.csv"
"$perimap" ecg "$work/same.csv" --beats "$work/same" > /dev/null
cd "$work"
for input in r100.hea r100.dat r100 "$work/r100.hea" ./r100; do
  "$perimap" ecg "$input" --beats beats > /dev/null
  # Times of a record count from its first sample; those of the table from 60 s.
  awk -F, 'NR == FNR { t[FNR] = $1; class[FNR] = $2; next }
      FNR > 1 && ($1 - t[FNR] + 60) ^ 2 > 1e-6 || $2 != class[FNR] { wrong = 1 } END { exit wrong || FNR < 30 }' same beats ||
    fail "other beats of $input" same beats
done
# Beats do not depend on the gain.
"$perimap" ecg r100 --gain 0.02 --beats gained > /dev/null
cut -d, -f1,2 beats > plain
cut -d, -f1,2 gained | cmp - plain || fail "other beats with another gain"
"$perimap" ecg r100 --column 1 --beats first > /dev/null
cmp first beats || fail "signal 1 is not the first"
"$perimap" ecg r100 --column 2 --beats second > text
[ "$(wc -l < second)" -eq 1 ] && grep -q 'unusable for [1-9]' text || fail "signal 2 is not the flat one" text

# Two leads: beside the flat one the beats are those of the first, and what was read is said.
for two in '--signal 1 --signal 2' '--signal 1,2' '--column 1,2' '--column 1 --column 2' '--column 2,1'; do
  # shellcheck disable=SC2086
  "$perimap" ecg $two r100 --beats two > text
  [ "$(grep -c '^signal      [12] of the record' text)" -eq 2 ] || fail "two signals were not read: $two" text
  awk -F, 'NR == FNR { t[FNR] = $1; next } FNR > 1 && ($1 - t[FNR]) ^ 2 > 1e-6 { wrong = 1 } END { exit wrong || FNR < 30 }' \
    beats two || fail "other beats with $two" beats two
done
awk -F, 'NR > 1 { print $1 "," $2 ",0" }' same.csv > leads.csv
"$perimap" ecg leads.csv --column 2,3 --beats two > /dev/null
cut -d, -f1,2 same > plain
cut -d, -f1,2 two | cmp - plain || fail "other beats beside a column of nothing"
# ends EXIT_CODE PATTERN ARGUMENT...
ends() {
  code=$1 pattern=$2
  shift 2
  got=0
  "$perimap" ecg "$@" > out 2> error || got=$?
  [ "$got" -eq "$code" ] && grep -q -e "$pattern" error || fail "perimap ecg $*: $got" out error
}
ends 1 'r100.hea: there is no signal 3; it has 2' r100 --column 3
ends 2 'knows its rate' r100 --rate 360
ends 1 'signal 1 is asked for twice' r100 --signal 1,1
ends 2 'one lead or two are taken' r100 --signal 1 --signal 2 --signal 1
ends 2 'two leads lie in two columns' leads.csv --column 2,2
ends 1 'nothing.hea: expected a readable WFDB header' nothing.dat
head -c 43000 r100.dat > short.dat
sed s/r100/short/ r100.hea > short.hea
ends 1 'short.dat: byte 43000: the file ends after 10750 of 10800 samples' short
rm short.dat
ends 1 'short.dat: expected a readable WFDB signal file' short.hea

# Of a recording that was cut off, what a crash leaves, the ECG up to its last whole chunk, and it is said where that is.
"$perimap" ecg "$recording" --beats whole.csv --json > whole.json 2> error
[ ! -s error ] && grep -q '"input_damage": \[\]' whole.json || fail "damage in a whole recording" error whole.json
size=$(stat -c %s "$recording")
head -c $((size * 7 / 10)) "$recording" > cut.mcap
ends 0 "cut.mcap: byte $((size * 7 / 10)): .*cut off" cut.mcap --beats cut.csv --json
grep -q "\"cut.mcap: byte $((size * 7 / 10)): .*cut off" out || fail "the damage is not in the JSON" out
ended=$(sed -n 's/.*cut.mcap: is damaged: what is whole of its ECG ends \([0-9.]*\) s after its first sample$/\1/p' error)
awk -v s="$ended" 'BEGIN { exit !(s > 2 && s < 5) }' || fail "it is not said where it ended" error
lines=$(wc -l < cut.csv)
[ "$lines" -gt 2 ] && [ "$lines" -lt "$(wc -l < whole.csv)" ] || fail "$lines lines of a cut recording" cut.csv
awk -F, 'NR == FNR { known[$1] = 1; next } FNR > 1 && !($1 in known) { exit 1 }' whole.csv cut.csv ||
  fail "beats that the whole recording has not" whole.csv cut.csv
# Damage in its middle leaves a gap.
cp "$recording" middle.mcap
printf damaged | dd of=middle.mcap bs=1 seek=$((size / 2)) conv=notrunc 2> /dev/null
ends 0 "middle.mcap: byte [0-9]*: " middle.mcap --beats middle.csv
[ "$(wc -l < middle.csv)" -gt 2 ] || fail "no beats beside the damage" middle.csv
# Where nothing is whole there are no beats, and the table of before stays.
head -c 100000 "$recording" > cut.mcap
cp cut.csv before.csv
ends 1 'cut.mcap: byte 100000: .*cut off; nothing of its ECG is whole' cut.mcap --beats cut.csv
cmp cut.csv before.csv || fail "the table was written without beats"
