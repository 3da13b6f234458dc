#!/bin/bash
# perimapd over emulated devices with recording on: the recording holds every frame and replays; a disk that takes no
# more stops the recording and nothing else; `perimap record` does the same without a pipeline.
# devices_recorded.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML [all]
# Without `all` only the first of these.
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"

# session NAME COMMAND...: emulated devices that play the recording, $work/NAME.toml for them, and the command
session() {
  local name=$1
  shift
  mkdir -p "$work/$name"
  emulate "$recording"
  {
    devices_toml "$recording"
    printf '[recording]\nrecord = true\nfolder = "%s"\n' "$name"
  } > "$work/$name.toml"
  "$@" > "$work/$name.log" 2>&1 || fail "$name: ended with $?: $(tail -n 5 "$work/$name.log")"
  kill -INT $emulators
  wait $emulators || fail "the emulators ended with $?: $(cat "$work/emulators")"
}

frames_of() {
  "$perimap" replay "$1" --lockstep --json "$work/replay.json" > "$work/replay" 2>&1 ||
    fail "$1 does not replay: $(tail -n 3 "$work/replay")"
  node -e 'console.log(JSON.parse(require("fs").readFileSync(process.argv[1])).counts.frames)' "$work/replay.json"
}
played=$(frames_of "$recording")

session live "$perimapd" -c "$work/live.toml"
recorded=("$work"/live/*.mcap)
[ ${#recorded[@]} -eq 1 ] && [ -f "${recorded[0]}" ] || fail "expected one recording: $(cat "$work/live.log")"
frames=$(frames_of "${recorded[0]}")
[ "$frames" -eq "$played" ] || fail "$frames of $played frames were recorded"

if [ "${6:-}" != all ]; then
  echo "as promised: $played frames recorded and replayed"
  exit 0
fi

# A file that may not grow is like a full disk, but for this process alone. 1 MB is half a second of frames.
limited() (
  ulimit -f 1024
  exec "$@"
)
session full limited "$perimapd" -c "$work/full.toml"
grep -q 'recording stopped: .*File too large' "$work/full.log" || fail "no word of the full disk: $(cat "$work/full.log")"
sent=$(grep -oE '[0-9]+ surfaces' "$work/full.log" | tail -n 1)
[ "${sent%% *}" -ge 100 ] || fail "the full disk stopped the guidance: $(cat "$work/full.log")"

session alone "$perimap" record -c "$work/alone.toml" "$work/alone.mcap"
frames=$(frames_of "$work/alone.mcap")
[ "$frames" -eq "$played" ] || fail "perimap record: $frames of $played frames were recorded"
"$perimap" record -c "$work/alone.toml" "$work/alone.mcap" > "$work/again" 2>&1 && fail "a recording was overwritten"
echo "as promised: $played frames recorded and replayed, $sent with a full disk"
