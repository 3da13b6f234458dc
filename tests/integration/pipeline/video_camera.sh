#!/bin/bash
# perimapd with a video of tissue as its camera, looped, before an emulated tracker that keeps still and an emulated ECG
# of another heart: features are followed as perimap track follows them, and what is published is degraded, for want of
# parallax. Without a VIDEO: each of the folder that PERIMAP_FOOTAGE names; skipped without.
# video_camera.sh PERIMAPD PERIMAP VIDEO_SIZE WORK_FOLDER CYCLONEDDS_XML SECONDS [VIDEO]
set -uo pipefail
perimapd=$1 perimap=$2 size=$3 work=$4 seconds=$6
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"
features=120

# session NAME VIDEO: $work/NAME.watch has a line of JSON for each second
session() {
  local name=$1 video=$2 width height rate
  read -r width height rate < <("$size" "$video") || fail "$video: no video"
  "$perimap" track "$video" --features $features --csv "$work/$name.csv" > "$work/$name.track" 2>&1 ||
    fail "$name: track ended with $?: $(tail -n 3 "$work/$name.track")"
  start=$(awk '{printf "%.3f", $1 + 2}' /proc/uptime)
  "$perimap" emulate ndi=tcp:127.0.0.1:$port cyton="$line" --tool 0B=still:0,0,-500,1,0,0,0 --start "$start" \
    > "$work/emulators" 2>&1 &
  emulators=$!
  started+=($emulators)
  lens_yaml "$width" "$height" > "$work/$name.yaml"
  {
    still_toml "$video" "$name.yaml"
    printf '[features]\nmaximum = %d\nminimum_distance_px = 12\n' $features
  } > "$work/$name.toml"
  "$perimapd" -c "$work/$name.toml" 2> "$work/$name.log" &
  daemon=$!
  started+=($daemon)
  "$perimap" watch --domain $domain --json --wait 30 --duration "$seconds" > "$work/$name.watch" 2> "$work/$name.errors" ||
    fail "$name: watch ended with $?: $(cat "$work/$name.errors" "$work/$name.log")"
  kill -INT $daemon
  wait $daemon || fail "$name: perimapd ended with $?: $(tail -n 5 "$work/$name.log")"
  ended $daemon
  kill -INT $emulators
  wait $emulators || fail "the emulators ended with $?: $(cat "$work/emulators")"
  ended $emulators
}

# judge NAME: what was published was never good and lastly degraded for want of parallax; and how many features lived
judge() {
  node - "$work/$1.watch" "$work/$1.csv" $features << 'END_OF_JS' || fail "$1: $(tail -n 3 "$work/$1.log")"
const fs = require("fs");
const [watched, tracks, most] = process.argv.slice(2);
const lines = fs.readFileSync(watched, "utf8").trim().split("\n").map(JSON.parse);
const seconds = lines.filter(line => line.kind === "interval" && line.state);
const s = lines.filter(line => line.kind === "summary" && line.status).at(-1).status;
const live = s.features_tracked + s.features_starting + s.features_converging + s.features_converged + s.features_inconsistent;
const rows = fs.readFileSync(tracks, "utf8").trim().split("\n").slice(1).map(row => row.split(","));
const last = Math.max(...rows.map(row => Number(row[0])));
const tracked = rows.filter(row => Number(row[0]) === last && row[4] === "tracked").length;
// Where the machine does other things, what the finder's thread has found comes too late and is let go.
const busy = s.adoptions_late > 3;
const last_ones = seconds.slice(-3);
const degraded = last_ones.length === 3 && last_ones.every(({state, reason}) => state === "degraded" && reason === "no_parallax");
const good = seconds.filter(second => second.state === "good").length;
console.log(`${live} features live of ${most}, ${tracked} as perimap track has them${busy ? ", on a busy machine" : ""}; ` +
  `${good} of ${seconds.length} seconds good, the last ${last_ones.map(({state, reason}) => `${state} ${reason}`).join(", ")}`);
process.exit(degraded && good === 0 && (busy || live >= 0.9 * Math.min(most, tracked)) ? 0 : 1);
END_OF_JS
}

if [ $# -ge 7 ]; then
  session clip "$7"
  judge clip
  exit 0
fi
[ -n "${PERIMAP_FOOTAGE:-}" ] || exit 77
number=0
while IFS= read -r video; do
  number=$((number + 1))
  echo "$(basename "$video"):"
  session "footage-$number" "$video"
  judge "footage-$number"
done < <(find -L "$PERIMAP_FOOTAGE" -type f \( -name '*.mp4' -o -name '*.mkv' -o -name '*.avi' -o -name '*.mov' \) | sort)
[ $number -gt 0 ] || fail "no video in $PERIMAP_FOOTAGE"
