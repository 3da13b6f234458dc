#!/bin/bash
# A camera that is turned by 5 degrees against its hand-eye is doubted, told by its name, and nothing of its surfaces is
# good from then on; the same bytes come of any number of workers. The right set-up is not doubted.
# setup_doubted.sh PERIMAP WORK_FOLDER
set -euo pipefail
. "$(dirname "$0")/../figures.sh"
perimap=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
"$perimap" simulate "$work/session.mcap" --duration 22 --size 320x240 --seed 7 --tracker-noise 0.5 > /dev/null 2>&1

replay() {  # NAME WORKERS ARGUMENT...
  local name=$1 workers=$2
  shift 2
  "$perimap" replay "$work/session.mcap" "$@" --lockstep --workers "$workers" --samples "$work/$name.mcap" \
    --json "$work/$name.json" > "$work/$name.txt" 2> "$work/stderr" || { cat "$work/stderr"; exit 1; }
}

replay right 2
grep -q '"doubted": false' "$work/right.json"
grep -q '"doubted_after_s": null' "$work/right.json" || { grep words "$work/right.json"; exit 1; }

printf 'version = 1\n[tracker]\nhand_eye_rotation_SC_wxyz = [0.8205283, 0.0722396, -0.0035192, 0.5670118]\n' > "$work/turned.toml"
for workers in 1 2 4; do replay "turned$workers" $workers -c "$work/turned.toml"; done
cmp "$work/turned1.mcap" "$work/turned2.mcap"
cmp "$work/turned1.mcap" "$work/turned4.mcap"
grep -q '"doubted": true' "$work/turned1.json" || { grep -A30 '"setup"' "$work/turned1.json"; exit 1; }
grep -q '"number": "hand_eye_turn' "$work/turned1.json"
grep '^set-up  *doubted, positions are off by' "$work/turned1.txt"

# The report counts from 15 s on, long after the doubt: none of its surfaces is good, nor a position.
not_good=$(($(number "$work/turned1.json" surfaces_degraded) + $(number "$work/turned1.json" surfaces_invalid)))
[ "$not_good" -ge $((30 * (22 - 15))) ] || { echo "FAILED: only $not_good surfaces after 15 s are not good"; exit 1; }
[ "$(number "$work/turned1.json" good_positions)" -eq 0 ] || { echo "FAILED: positions are good though doubted"; exit 1; }
[ "$(number "$work/right.json" good_positions)" -gt 10000 ] || { echo "FAILED: the right set-up has no good positions"; exit 1; }
