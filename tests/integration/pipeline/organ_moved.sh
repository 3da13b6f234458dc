#!/bin/bash
# An organ that is pulled aside is told by a reason of its own, and its surfaces are not good until it is back; the same
# bytes come of any number of workers.
# organ_moved.sh PERIMAP WORK_FOLDER
set -euo pipefail
. "$(dirname "$0")/../figures.sh"
perimap=$1 work=$2
fail() {
  echo "FAILED: $1" >&2
  cat "$work/replay.txt" >&2 || true
  exit 1
}
rm -rf "$work"
mkdir -p "$work"
cat > "$work/moved.toml" << 'END'
version = 1

[[event]]
kind = "retraction"
at_s = 22.0
for_s = 2.5
shift_mm = [6.0, -3.0, 1.0]
turn_deg = 3.0

[[event]]
kind = "retraction"
at_s = 32.0
for_s = 2.5
shift_mm = [0.0, 0.0, 0.0]
END
"$perimap" simulate "$work/session.mcap" --procedure "$work/moved.toml" --duration 44 --size 320x240 --fps 15 --seed 5 \
  --tracker-dropouts 0 > "$work/simulate.txt" 2>&1

replay() { "$perimap" replay "$work/session.mcap" --lockstep --workers "$1" --json "$work/$2.json" --samples "$work/$2.mcap" > "$work/replay.txt" 2>&1; }
replay 3 three
replay 1 one
cmp "$work/one.mcap" "$work/three.mcap" || fail "the samples depend on the number of workers"

told=$(tr -d ' \n' < "$work/one.json" | grep -o '{[^{}]*"kind":"retraction"[^{}]*}' | head -n 1)
grep -q '"right":true' <<< "$told" || fail "the organ is not said to have moved: $told"
grep -q '"cause_said":"organ_or_tracker_moved"' <<< "$told" || echo "$told"
awk -v v="$(number "$work/one.json" wrong_while_good_s)" 'BEGIN { exit !(v <= 1.5) }' || fail "wrong while good"
tail -30 "$work/replay.txt"
