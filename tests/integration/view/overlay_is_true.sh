#!/bin/bash
# overlay_is_true.sh PERIMAP CHECK WORK_FOLDER [SIMULATE_OPTION...]: what the page of a recording draws over its pictures
# lies where the heart truly was.
set -uo pipefail
perimap=$1 check=$2 work=$3
shift 3
rm -rf "$work"
mkdir -p "$work"
fail() {
  echo "FAILED: $1"
  exit 1
}
"$perimap" simulate "$work/heart.mcap" --size 320x240 "$@" > "$work/simulate" 2>&1 || fail "$(cat "$work/simulate")"
"$perimap" replay "$work/heart.mcap" --lockstep --samples "$work/samples.mcap" > "$work/replay" 2>&1 || fail "$(cat "$work/replay")"
"$perimap" view "$work/heart.mcap" --samples "$work/samples.mcap" --port 0 > "$work/address" 2> "$work/said" &
view=$!
trap 'kill $view 2> /dev/null' EXIT
for _ in $(seq 300); do
  if [ -s "$work/address" ]; then break; fi
  sleep 0.1
done
"$check" "$(cat "$work/address")" "$work/heart.mcap" "$work/samples.mcap" || fail "see above"
