#!/bin/sh
# perimap replay, perimap report and perimap session write over nothing that they read.
set -eu
perimap=$1
recording=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
head -c 100000 "$recording" > r.mcap
printf 'samples' > s.mcap
ln -s r.mcap link.mcap
sum=$(cat r.mcap s.mcap | cksum)

# refuses COMMAND ARGUMENT...
refuses() {
  got=0
  "$perimap" "$@" > out 2> error || got=$?
  [ "$got" -eq 2 ] && grep -q -e "$option: is" error || { echo "perimap $*: $got"; cat out error; exit 1; }
  [ "$(cat r.mcap s.mcap | cksum)" = "$sum" ] || { echo "perimap $*: written over"; exit 1; }
}
for name in r.mcap link.mcap "$work/r.mcap"; do
  for option in --json --samples; do refuses replay --lockstep r.mcap "$option" "$name"; done
  for option in --json --picture; do refuses report r.mcap --samples s.mcap "$option" "$name"; done
  option=--html
  refuses session r.mcap --samples s.mcap --html "$name"
done
for option in --json --picture; do refuses report r.mcap --samples s.mcap "$option" s.mcap; done
