#!/bin/bash
# perimapd over emulated devices with recording on: the recording holds every frame and replays; a disk that takes no
# more stops the recording and nothing else; `perimap record` does the same without a pipeline. `perimap ctl record` begins
# and ends a recording while perimapd runs.
# devices_recorded.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML [all|switched]
# Without `all` only the first of these; with `switched` only the last.
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
    printf '[recording]\nrecord = %s\nfolder = "%s"\nmemory_MB = 32\n' "${record:-true}" "$name"
    printf '[control]\nsocket = "%s"\n' "$short/control"
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

# perimapd that records nothing until it is told to, twice.
switched() {
  # grep without -q: it would close the pipe on what ctl still writes.
  local told=(timeout 20 "$perimap" ctl --socket "$short/control")
  "$perimapd" -c "$work/switched.toml" &
  local daemon=$!
  for _ in $(seq 100); do [ ! -S "$short/control" ] || break; sleep 0.05; done
  "${told[@]}" status | grep '^recording: off$' > /dev/null || fail "it records unasked"
  "${told[@]}" record off && fail "what is not recorded was ended"
  # From when the emulated recording has begun.
  until [ "$(awk -v s="$start" '{print ($1 > s + 0.5)}' /proc/uptime)" = 1 ]; do sleep 0.1; done
  for _ in 1 2; do
    "${told[@]}" record on | grep "^recording to .*switched/perimap-.*mcap$" > /dev/null || fail "it does not say where it records"
    "${told[@]}" record on && fail "two recordings at once"
    "${told[@]}" status | grep '^recording: on$' > /dev/null || fail "the status does not say that it records"
    sleep 0.7
    "${told[@]}" record off | grep '^recorded to ' > /dev/null || fail "it does not say what it recorded"
    "${told[@]}" status | grep '^recording: off$' > /dev/null || fail "the status says that it still records"
  done
  wait $daemon
}
if [ "${6:-}" = switched ]; then
  record=false session switched switched
  recorded=("$work"/switched/*.mcap)
  [ ${#recorded[@]} -eq 2 ] || fail "expected two recordings: $(ls "$work/switched")"
  for file in "${recorded[@]}"; do
    frames=$(frames_of "$file")
    [ "$frames" -ge 15 ] && [ "$frames" -le 75 ] || fail "$frames frames in about a second of $file"
  done
  [ "$(grep -cE 'command record (on|off) from user [0-9]+ \(.*\), group [0-9]+, process [0-9]+: done' "$work/switched.log")" -eq 4 ] ||
    fail "the commands are not in the log: $(cat "$work/switched.log")"
  echo "as promised: two recordings, begun and ended at run time"
  exit 0
fi

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
