#!/bin/sh
# perimap ecg: --beats replaces an earlier table, and nothing that is read.
set -eu
perimap=$1
data=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$data/100_60s.csv" in.csv
cp "$data/100_60s_beats.csv" reference.csv
ln -s in.csv link.csv
ln in.csv hard.csv
mkdir folder
printf 'r 1 360\nsamples.bin 16\n' > r.hea
printf 'r' > r.dat
printf 'samples' > samples.bin
printf 'recording' > r.mcap
sum=$(cat in.csv reference.csv r.hea r.dat samples.bin r.mcap | cksum)

# refuses WHAT ARGUMENT...
refuses() {
  what=$1
  shift
  got=0
  "$perimap" ecg "$@" > out 2> error || got=$?
  [ "$got" -eq 2 ] && grep -q -e "--beats: is $what" error || { echo "perimap ecg $*: $got"; cat out error; exit 1; }
  [ "$(cat in.csv reference.csv r.hea r.dat samples.bin r.mcap | cksum)" = "$sum" ] || { echo "perimap ecg $*: written over"; exit 1; }
}
for name in in.csv ./in.csv folder/../in.csv "$work/in.csv" link.csv hard.csv; do
  refuses 'INPUT itself' in.csv --beats "$name"
done
refuses 'INPUT itself' link.csv --beats in.csv
refuses 'INPUT itself' r.mcap --beats r.mcap
refuses 'the file of --reference' in.csv --beats reference.csv --reference reference.csv
for input in r r.hea r.dat; do
  for output in r.hea r.dat samples.bin; do
    [ "$input" = "$output" ] || refuses "$output, of the record INPUT" "$input" --beats "$output"
  done
done
refuses 'INPUT itself' r.hea --beats r.hea

# An earlier table is replaced, also with what is read beside it; a pipe is written to.
printf 'earlier\n' > out.csv
"$perimap" ecg in.csv --beats out.csv --reference reference.csv > /dev/null
[ "$(head -n 1 out.csv)" = time_s,class,confidence,detected_at_s ] || { echo "an earlier table stayed"; exit 1; }
"$perimap" ecg in.csv --beats /dev/stdout | grep -q '^time_s,class' || { echo "nothing on the standard output"; exit 1; }
