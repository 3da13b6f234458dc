#!/bin/bash
# Every thread of perimapd at work over a minute: tracker and ECG outside it, a camera's frames at their times, workers,
# finder, starter, publisher, recorder, checkpoints; a subscriber that comes and goes; and commands: status, recording on
# and off, a new patient, the configuration read anew. For ThreadSanitizer, whose reports end a program with an exit code.
# every_thread.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML SECONDS [slow]
# `slow`: with a sanitizer, so nothing is asked of what is mapped, and a command may run out of patience.
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4 seconds=$6 slow=${7:-}
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"

emulate "$recording"
# configure LOG_LEVEL
configure() {
  devices_toml "$recording"
  printf '[control]\nsocket = "%s"\n[checkpoint]\nfile = "%s"\ninterval_s = 0.5\n' "$short/control" "$work/checkpoint"
  printf '[recording]\nfolder = "recordings"\nmemory_MB = 32\n[status]\ninterval_s = 0.2\n[log]\nlevel = "%s"\n' "$1"
}
mkdir "$work/recordings"
configure info > "$work/devices.toml"
"$perimapd" -c "$work/devices.toml" 2> "$work/log" &
daemon=$!
started+=($daemon)

# counts of what was done, by command
declare -A did=([status]=0 ["record on"]=0 ["record off"]=0 [new-patient]=0 [reload]=0)
refused=0
# tell COMMAND
tell() {
  # shellcheck disable=SC2086 # a command may be two words
  if timeout 60 "$perimap" ctl --socket "$short/control" $1 > "$work/answer" 2>&1; then
    did[$1]=$((did[$1] + 1))
  else
    local code=$?
    [ "$slow" = slow ] && [ $code -eq 1 ] || fail "$1 ended with $code: $(cat "$work/answer")"
    refused=$((refused + 1))
  fi
}
# A subscriber that stays for some time, then for some time there is none; in the background.
subscribers() {
  local n=0
  while kill -0 $daemon 2> /dev/null; do
    timeout 60 "$perimap" watch --domain $domain --wait 50 --duration "$((1 + n % 3))" > "$work/watch-$n" 2>&1
    local code=$?
    # 1: no surface came, because it ended meanwhile.
    [ $code -le 1 ] || echo "watch $n ended with $code" >> "$work/subscribers"
    n=$((n + 1))
    sleep 0.5
  done
  echo "$n subscribers" >> "$work/subscribers"
}
subscribers &
watching=$!
started+=($watching)

for _ in $(seq 600); do
  [ ! -S "$short/control" ] || break
  kill -0 $daemon 2> /dev/null || fail "it ended: $(tail -n 30 "$work/log")"
  sleep 0.1
done
# From when its sources play.
until awk -v s="$start" '{exit !($1 >= s)}' /proc/uptime; do sleep 0.2; done
for ((i = 0; i < 1000; i++)); do
  awk -v s="$start" -v n="$seconds" '{exit !($1 < s + n)}' /proc/uptime || break
  kill -0 $daemon 2> /dev/null || fail "it ended: $(tail -n 30 "$work/log")"
  tell status
  tell "record on"
  sleep 0.7
  configure "$([ $((i % 2)) -eq 0 ] && echo debug || echo info)" > "$work/devices.toml"
  tell reload
  tell status
  sleep 0.3
  tell "record off"
  # Rarely enough that something is mapped in between.
  if [ $((i % 8)) -eq 7 ]; then tell new-patient; fi
done
kill -TERM $daemon
wait $daemon || fail "it ended with $?: $(grep -A 40 ThreadSanitizer "$work/log" | head -n 60; tail -n 3 "$work/log")"
ended $daemon
wait $watching
ended $watching
kill -INT "$emulators"
wait "$emulators" || fail "the emulators ended with $?: $(tail -n 40 "$work/emulators")"
ended "$emulators"
grep -q ThreadSanitizer "$work/log" "$work"/watch-* && fail "a report: $(grep -h -A 40 ThreadSanitizer "$work/log" "$work"/watch-* | head -n 60)"
grep -q 'ended with' "$work/subscribers" && fail "$(cat "$work/subscribers")"
found=$("$(dirname "$0")/log_without_data.sh" "$work/log") || fail "$found"
for command in "${!did[@]}"; do
  [ "${did[$command]}" -gt 0 ] || fail "$command was never done"
done
sent=$(grep -oE '[0-9]+ surfaces' "$work/log" | tail -n 1)
[ "$slow" = slow ] || [ "${sent%% *}" -ge $((20 * seconds)) ] || fail "it published too little: $sent"
rm -rf "$work/recordings"
echo "$(tail -n 1 "$work/subscribers"), $sent; status ${did[status]}, recordings ${did["record on"]}, reload ${did[reload]}, new patient ${did[new-patient]}; refused $refused"
