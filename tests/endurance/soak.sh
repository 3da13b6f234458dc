#!/bin/bash
# perimapd for as long as asked, with all that goes on beside it: a camera's clip in a loop, whose seam comes every few
# seconds; a tracker and an ECG that are unplugged and come back; keys; subscribers that come and go, and one that stays;
# a page; a recording that is switched on and off; commands; a black box. Every five seconds its memory, its descriptors
# and how late surfaces were are noted; at the end they are judged, printed, and drawn.
# soak.sh PERIMAPD PERIMAP CLIP WORK_FOLDER CYCLONEDDS_XML SECONDS
set -uo pipefail
perimapd=$1 perimap=$2 clip=$3 work=$4 seconds=$6
export CYCLONEDDS_URI=file://$5
here=$(dirname "$0")
source "$here/../integration/emulated_devices.sh"

for make in "init" "issue publisher theatre" "issue display navigation" "issue display page"; do
  # shellcheck disable=SC2086 # a command and its words
  "$perimap" keys $make --directory "$work/keys" > "$work/keys-made" 2>&1 || fail "keys $make: $(cat "$work/keys-made")"
done
start=$(awk '{printf "%.3f", $1 + 2}' /proc/uptime)
"$perimap" emulate ndi=tcp:127.0.0.1:$port cyton="$line" --tool 0B=still:0,0,-500,1,0,0,0 --start "$start" \
  --duration $((seconds + 600)) --unplug 97 3 > "$work/emulators" 2>&1 &
emulators=$!
started+=($emulators)
mkdir "$work/recordings"
lens_yaml 360 288 > "$work/lens.yaml"
{
  still_toml "$clip" lens.yaml  # up to its section of DDS
  cat << END
security = "$work/keys/theatre"
[recording]
folder = "recordings"
memory_MB = 32
[control]
socket = "$short/control"
[checkpoint]
file = "$work/checkpoint"
[blackbox]
folder = "$work/black-box"
maximum_MB = 256
END
} > "$work/perimapd.toml"
"$perimapd" -c "$work/perimapd.toml" 2> "$work/log" &
daemon=$!
started+=($daemon)
"$perimap" watch --domain $domain --security "$work/keys/navigation" --json --wait 60 > "$work/watch" 2> "$work/watch-errors" &
watch=$!
started+=($watch)
"$perimap" view --domain $domain --security "$work/keys/page" --port 0 > "$work/view" 2>&1 &
view=$!
started+=($view)

tell() { timeout 60 "$perimap" ctl --socket "$short/control" "$@" > "$work/answer" 2>&1; }
for _ in $(seq 600); do
  [ ! -S "$short/control" ] || break
  kill -0 $daemon 2> /dev/null || fail "it ended: $(tail -n 5 "$work/log")"
  sleep 0.1
done
page=$(grep -oE 'http://[^ ]+' "$work/view" | head -n 1)
begun=$SECONDS
refused=0
: > "$work/noted"
for ((round = 0; SECONDS - begun < seconds; round++)); do
  kill -0 $daemon 2> /dev/null || fail "it ended after $((SECONDS - begun)) s: $(tail -n 5 "$work/log")"
  # s since the start, KiB that are its own, descriptors
  echo "$((SECONDS - begun)) $(awk '/^RssAnon/ {print $2}' "/proc/$daemon/status") $(find "/proc/$daemon/fd" -mindepth 1 2> /dev/null | wc -l)" >> "$work/noted"
  case $((round % 12)) in
    1) tell record on || refused=$((refused + 1)) ;;
    4) tell record off || refused=$((refused + 1)) && rm -f "$work"/recordings/*.mcap ;;
    6) timeout 20 "$perimap" watch --domain $domain --security "$work/keys/navigation" --wait 10 --duration 3 > "$work/other" 2>&1 ;;
    8) node -e 'fetch(process.argv[1]).then((r) => process.exit(r.ok ? 0 : 1))' "$page" || fail "the page does not answer" ;;
    10) tell reload || refused=$((refused + 1)) ;;
  esac
  # Rarely, so that the map grows in between.
  if [ $((round % 120)) -eq 119 ]; then tell new-patient || refused=$((refused + 1)); fi
  tell status || refused=$((refused + 1))
  sleep 4.5
done
for pid in $watch $view; do
  kill -INT "$pid"
  wait "$pid" || fail "$(tail -n 3 "$work/watch-errors" "$work/view")"
  ended "$pid"
done
kill -TERM $daemon
wait $daemon || fail "it ended with $?: $(tail -n 5 "$work/log")"
ended $daemon
"$perimap" verify-log "$work/black-box" > "$work/verified" 2>&1 || fail "black box: $(tail -n 3 "$work/verified")"
tail -n 1 "$work/verified"
node "$here/soak.mjs" "$work/noted" "$work/watch" "$work/soak.svg" "$refused" || fail "see the figures above, and $work/soak.svg"
echo "as promised; the picture is $work/soak.svg"
