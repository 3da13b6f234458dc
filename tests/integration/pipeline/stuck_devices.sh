#!/bin/bash
# While tracker and camera give again and again what they gave, surfaces say so and none is good; what was learnt before is
# good again when they have recovered.
# stuck_devices.sh PERIMAP WORK_FOLDER
set -euo pipefail
. "$(dirname "$0")/../figures.sh"
perimap=$1 work=$2
rm -rf "$work"
mkdir -p "$work"

# What became of a session of 24 s, in which a device is stuck from 16 to 20 s: 105 of its 720 surfaces, but for the half
# second in which that is not known yet.
session() {  # NAME ARGUMENT...
  local name=$1
  shift
  "$perimap" simulate "$work/$name.mcap" --duration 24 --size 320x240 --seed 90417 --tracker-noise 0 "$@" > /dev/null 2>&1
  "$perimap" replay "$work/$name.mcap" --lockstep --json "$work/$name.json" > "$work/$name.txt" 2> "$work/stderr" ||
    { cat "$work/stderr"; exit 1; }
  rm "$work/$name.mcap"
}

session well
session tracker --tracker-stuck 16:4
session camera --camera-stuck 16:4
session slow --camera-repeats 2
for name in tracker camera; do
  more=$(($(number "$work/$name.json" surfaces_degraded) - $(number "$work/well.json" surfaces_degraded)))
  [ $more -ge 100 ] && [ $more -le 130 ] || { echo "FAILED: $name: $more more surfaces are degraded"; exit 1; }
  [ "$(number "$work/$name.json" good_positions_off)" -eq 0 ] || { echo "FAILED: $name: good positions are off"; exit 1; }
  [ "$(number "$work/$name.json" good_positions)" -gt $(($(number "$work/well.json" good_positions) / 3)) ] ||
    { echo "FAILED: $name: hardly anything is good"; exit 1; }
done
[ "$(number "$work/slow.json" frames_repeated)" -ge 350 ] || { echo "FAILED: pictures that come twice are not counted"; exit 1; }
[ "$(number "$work/slow.json" good_positions_off)" -eq 0 ] || { echo "FAILED: pictures that come twice are learnt from twice"; exit 1; }
