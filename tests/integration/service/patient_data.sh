#!/bin/bash
# What perimapd knows of a patient, as SECURITY.md has it: recordings are their owner's alone whatever the umask says,
# from their first byte on, or of the group that is named; `new-patient` leaves neither a checkpoint nor what an
# interrupted write of one has left; and the log, at its most talkative, holds no picture, no ECG and no position.
# patient_data.sh PERIMAPD PERIMAP WORK_FOLDER CYCLONEDDS_XML
set -uo pipefail
perimapd=$1 perimap=$2 work=$3
export CYCLONEDDS_URI=file://$4
source "$(dirname "$0")/../emulated_devices.sh"
umask 000

mkdir "$work"/{own,shared}
# Longer than what follows takes on a machine that is busy; of few and small frames.
recording=$work/heart.mcap
"$perimap" simulate "$recording" --duration 90 --size 160x120 --fps 2 --tracker-noise 0 > "$work/simulated" 2>&1 ||
  fail "$(cat "$work/simulated")"
tell() {
  timeout 60 "$perimap" ctl --socket "$short/control" "$@" > "$work/answer" 2>&1 || fail "$*: $(cat "$work/answer")"
}
# One figure of its status; 0 while it does not answer.
status() {
  "$perimap" ctl --socket "$short/control" status 2> /dev/null | awk -v key="$1:" '$1 == key {v = $2} END {print v + 0}'
}
# Waits for a line of the shell to be true.
until_true() {
  local _
  for _ in $(seq 300); do
    if eval "$1"; then return 0; fi
    kill -0 "$daemon" 2> /dev/null || fail "it ended: $(tail -n 3 "$work/log")"
    sleep 0.1
  done
  fail "not within 30 s: $1; $(tail -n 3 "$work/log")"
}
# run FOLDER CONFIGURATION: perimapd with its recordings in the folder, until it takes commands
run() {
  emulate "$recording"
  { devices_toml "$recording" && printf '[control]\nsocket = "%s"\n[log]\nlevel = "trace"\n' "$short/control" &&
    printf '[checkpoint]\nfile = "%s/checkpoint"\n[recording]\nfolder = "%s"\n%s\n' "$work/$1" "$1" "$2"
  } > "$work/$1.toml"
  "$perimapd" -c "$work/$1.toml" 2> "$work/log" &
  daemon=$!
  started+=("$daemon")
  until_true '[ -S "$short/control" ]'
}
stop() {
  local pid
  for pid in "$daemon" "$emulators"; do
    kill -TERM "$pid"
    wait "$pid" 2> /dev/null
    ended "$pid"
  done
}
# What others, or a group, may do with one of the files of a folder.
open_to() { find "$work/$1" -type f -perm "/$2" -printf '%f %m\n'; }

# ---- their owner's alone
run own ''
tell record on
# Until its camera, tracker and ECG have been playing for some seconds.
until_true '[ "$(status samples)" -ge 10 ]'
[ -z "$(open_to own 077)" ] || fail "while it records: $(open_to own 077)"
tell record off
[ -z "$(open_to own 077)" ] || fail "others may use: $(open_to own 077)"

# ---- a new patient. What the old one's run has left is as good as a checkpoint of this one, which needs a map.
echo "the old patient's" > "$work/own/checkpoint"
echo "half of the old patient's" > "$work/own/checkpoint.part"
tell new-patient
for file in "$work"/own/checkpoint*; do
  [ ! -e "$file" ] || fail "$file is left"
done
stop
cp "$work/log" "$work/log-own"

# ---- a group's
group=$(id -gn)
run shared "group = \"$group\""
tell record on
sleep 1
tell record off
stop
[ -z "$(open_to shared 037)" ] || fail "with a group: $(open_to shared 037)"
[ -n "$(find "$work/shared" -name '*.mcap' -perm 640 -group "$group")" ] || fail "the group: $(ls -l "$work/shared")"

# ---- the log
grep -qE 'new-patient from user [0-9]+' "$work/log-own" || fail "who told it of a new patient is not in the log"
found=$("$(dirname "$0")/log_without_data.sh" "$work/log" "$work/log-own") || fail "$found"
echo "$(cat "$work/log" "$work/log-own" | wc -l) lines of log, as promised"
