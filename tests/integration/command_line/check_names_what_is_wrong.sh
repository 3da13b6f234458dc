#!/bin/bash
# `perimap check`: exit codes, one line on an error, and an effective configuration that checks again to the same.
#   check_names_what_is_wrong.sh PERIMAP PERIMAPD
set -u
perimap=$1 perimapd=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}

printf 'version = 1\n[replay]\nrecording = "x.mcap"\n[phase]\nlaw = "warped"\n' >"$scratch/good.toml"
"$perimap" check "$scratch/good.toml" 2>"$scratch/error" && fail "a missing recording was accepted"
touch "$scratch/x.mcap"
"$perimap" check "$scratch/good.toml" >"$scratch/effective.toml" || fail "a good configuration ended with $?"
"$perimap" check "$scratch/effective.toml" >"$scratch/again.toml" || fail "the effective configuration ended with $?"
cmp "$scratch/effective.toml" "$scratch/again.toml" || fail "the effective configuration is not its own"

grep -q '^# stream "frame": ' "$scratch/effective.toml" || fail "what is published is not told"
grep -q 'stream "clock"' "$scratch/effective.toml" && fail "a stream is told that is not published"
printf 'version = 1\n[pipeline]\nrelease = "both"\nclock_rate_hz = 1000\n' >"$scratch/both.toml"
"$perimap" check "$scratch/both.toml" >"$scratch/out" || fail "both streams ended with $?"
grep -q '^# stream "clock": 1000 surfaces/s' "$scratch/out" || fail "the clock's stream is not told"
grep -q '^# surfaces of at most .* of 50 MB/s' "$scratch/out" || fail "the bytes a second are not told"
printf '[dds]\nmaximum_MB_per_s = 1\n' >>"$scratch/both.toml"
"$perimap" check "$scratch/both.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "more than may be published must end with 2"
grep -q "both.toml:4:17: key 'pipeline.clock_rate_hz': expected what dds.maximum_MB_per_s = 1 allows" "$scratch/error" ||
  fail "$(cat "$scratch/error")"

# What this user would be refused is told, and the configuration is sound all the same. A processor that is not there is
# refused to everyone; any memory may be locked by root, and by whoever has no limit.
printf 'version = 1\n[realtime]\npriority = 10\ncpus = [1023]\nlock_memory = false\n' >"$scratch/refused.toml"
"$perimap" check "$scratch/refused.toml" >"$scratch/out" 2>"$scratch/error" || fail "refused priority ended with $?"
[ "$(wc -l <"$scratch/error")" -eq 1 ] || fail "not one line of a refused priority: $(cat "$scratch/error")"
grep -q '^perimap check: note: this user is not given SCHED_FIFO priority 10 ' "$scratch/error" || fail "$(cat "$scratch/error")"
printf 'version = 1\n[realtime]\npriority = 0\ncpus = [1023]\nlock_memory = true\n' >"$scratch/locked.toml"
other_user=()
[ "$(id -u)" -ne 0 ] || other_user=(unshare --user)
if "${other_user[@]}" true 2>"$scratch/error"; then
  (ulimit -l 64 && exec "${other_user[@]}" "$perimap" check "$scratch/locked.toml") >"$scratch/out" 2>"$scratch/error" ||
    fail "refused memory ended with $?"
  [ "$(wc -l <"$scratch/error")" -eq 1 ] || fail "not one line of refused memory: $(cat "$scratch/error")"
  grep -q '^perimap check: note: this user may not lock memory ' "$scratch/error" || fail "$(cat "$scratch/error")"
fi
sed 's/^lock_memory = true/lock_memory = false/' "$scratch/locked.toml" >"$scratch/nothing.toml"
"$perimap" check "$scratch/nothing.toml" >"$scratch/out" 2>"$scratch/error" || fail "nothing asked for ended with $?"
[ ! -s "$scratch/error" ] || fail "nothing was asked for, but: $(cat "$scratch/error")"

# A calibration of something else is refused in one line; an old one is warned of.
cat >"$scratch/tracker.toml" <<'END'
version = 1
[tracker]
protocol = "ndi"
port = "tcp:127.0.0.1:8765"
sensor = "0B"
position_deviation_mm = 0.3
hand_eye_translation_SC_mm = [0, 0, 200]
hand_eye_date = "2020-02-29"
hand_eye_sensor = "0B"
[realtime]
lock_memory = false
END
"$perimap" check "$scratch/tracker.toml" >"$scratch/out" 2>"$scratch/error" || fail "an old hand-eye ended with $?"
grep -q '^perimap check: warning: tracker.hand_eye_date: the hand-eye of 2020-02-29 is .* days old' "$scratch/error" ||
  fail "$(cat "$scratch/error")"
sed 's/^sensor = "0B"/sensor = "0A"/' "$scratch/tracker.toml" >"$scratch/other.toml"
"$perimap" check "$scratch/other.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "a hand-eye of another sensor must end with 2"
[ "$(wc -l <"$scratch/error")" -eq 1 ] || fail "not one line: $(cat "$scratch/error")"
grep -q "other.toml:9:19: key 'tracker.hand_eye_sensor': .*perimap calibrate hand-eye" "$scratch/error" || fail "$(cat "$scratch/error")"

# A lens of a picture half as large has its principal point on the corner.
lens=$(cd "$(dirname "$0")/../../data/refused_once" && pwd)/k_half.yaml
printf 'version = 1\n[camera]\ncalibration = "%s"\n[realtime]\nlock_memory = false\n' "$lens" >"$scratch/half.toml"
"$perimap" check "$scratch/half.toml" >"$scratch/out" 2>"$scratch/error" || fail "a principal point on the corner ended with $?"
grep -q '^perimap check: warning: camera.calibration: the principal point 320 240 is' "$scratch/error" || fail "$(cat "$scratch/error")"
# Of another size than the configuration says, also where it names no device.
sed 's/^calibration/width = 640\nheight = 480\ncalibration/' "$scratch/half.toml" >"$scratch/wide.toml"
"$perimap" check "$scratch/wide.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "a lens of another size must end with 2"
grep -q "wide.toml:3:9: key 'camera.width': expected the calibration's 320x240, got 640x480" "$scratch/error" || fail "$(cat "$scratch/error")"

# What calibrate writes is what check compares.
awk 'BEGIN {
  print "t_s,x,y,z,qx,qy,qz,qw"
  for (i = 0; i < 400; ++i) {
    a = 0.4 * sin(0.1 * i); b = 0.4 * cos(0.13 * i)
    printf "%.3f,%.6f,%.6f,%.6f,%.9f,%.9f,%.9f,%.9f\n", i / 50, -150 * sin(2 * b), 150 * sin(2 * a) * cos(2 * b),
      -150 * cos(2 * a) * cos(2 * b), sin(a) * cos(b), cos(a) * sin(b), sin(a) * sin(b), cos(a) * cos(b)
  }
}' >"$scratch/pivot.csv"
"$perimap" calibrate tool "$scratch/pivot.csv" --unit mm --tool 0D --output "$scratch/tip.json" >"$scratch/out" 2>"$scratch/error" ||
  fail "the tip was not measured: $(cat "$scratch/error")"
sed 's/^sensor = "0B"/sensor = "0B"\npointer = "0D"\npointer_calibration = "tip.json"/' "$scratch/tracker.toml" >"$scratch/pointer.toml"
"$perimap" check "$scratch/pointer.toml" >"$scratch/out" 2>"$scratch/error" || fail "the tip does not fit: $(cat "$scratch/error")"
sed 's/^pointer = "0D"/pointer = "0C"/' "$scratch/pointer.toml" >"$scratch/other.toml"
"$perimap" check "$scratch/other.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "a tip of another tool must end with 2"
grep -q "other.toml:[0-9]*:[0-9]*: key 'tracker.pointer_calibration': .*perimap calibrate tool" "$scratch/error" || fail "$(cat "$scratch/error")"

printf 'version = 1\n[phase]\nlaw = 3\n' >"$scratch/wrong.toml"
"$perimap" check "$scratch/wrong.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "a wrong configuration must end with 2"
[ ! -s "$scratch/out" ] || fail "a wrong configuration was printed"
[ "$(wc -l <"$scratch/error")" -eq 1 ] || fail "not one line: $(cat "$scratch/error")"
grep -q "^perimap check: $scratch/wrong.toml:3:7: key 'phase.law': expected " "$scratch/error" || fail "$(cat "$scratch/error")"
printf 'version = 1\n[ecg]\nr_trigger = true\nprotocol = "cyton"\nport = "/dev/ttyUSB0"\n' >"$scratch/trigger.toml"
"$perimap" check "$scratch/trigger.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "a trigger without a port must end with 2"
grep -q "trigger.toml:2:1: key 'ecg.r_trigger_port': expected the serial port" "$scratch/error" || fail "$(cat "$scratch/error")"
echo 'r_trigger_port = "/dev/ttyS0"' >>"$scratch/trigger.toml"
"$perimap" check "$scratch/trigger.toml" 2>"$scratch/error" | grep -q '^r_trigger_line = "dcd"' || fail "a trigger's line: $(cat "$scratch/error")"
printf 'version = 1\n[ecg]\nprotocol = "bitalino"\nport = "/dev/ttyUSB0"\n[respiration]\ndevice_channel = 7\n' >"$scratch/breath.toml"
"$perimap" check "$scratch/breath.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "an input that the device has not must end with 2"
grep -q "^perimap check: $scratch/breath.toml:6:18: key 'respiration.device_channel': expected 1 to 6 of a bitalino" "$scratch/error" || fail "$(cat "$scratch/error")"
for tools in 'protocol = "ndi" sensor = "A" reference = "0a"' 'protocol = "igtl" sensor = "Scope" reference = "Scope"'; do
  printf 'version = 1\n[tracker]\nport = "tcp:127.0.0.1:1"\n%s\n' "${tools//\" /\"$'\n'}" >"$scratch/tools.toml"
  "$perimap" check "$scratch/tools.toml" >"$scratch/out" 2>"$scratch/error"
  [ $? -eq 2 ] || fail "a tool that is its own reference must end with 2"
  grep -q "tools.toml:6:13: key 'tracker.reference': expected another tool" "$scratch/error" || fail "$(cat "$scratch/error")"
done
# All that is wrong in one run, each with its place.
printf 'version = 1\n[tracker]\nprotocol = "ndi"\nsensor = "0A"\nhand_eye_sensor = "0B"\n[ecg]\nprotocol = "cyton"\n[pipeline]\n' \
  >"$scratch/many.toml"
"$perimap" check "$scratch/many.toml" >"$scratch/out" 2>"$scratch/error"
[ $? -eq 2 ] || fail "many faults must end with 2"
told=$(sed "s|^perimap check: $scratch/||; s|: expected.*||" "$scratch/error")
[ "$told" = "many.toml:2:1: key 'tracker.port'
many.toml:5:19: key 'tracker.hand_eye_sensor'
many.toml:6:1: key 'ecg.port'" ] || fail "not all that is wrong, in its order: $(cat "$scratch/error")"
"$perimap" check /nowhere/x.toml 2>/dev/null
[ $? -eq 2 ] || fail "a missing configuration must end with 2"
"$perimap" check 2>/dev/null
[ $? -eq 2 ] || fail "wrong usage must end with 2"
"$perimap" --version | grep -q '^perimap [0-9]' || fail "no version"
"$perimapd" --version | grep -q '^perimapd [0-9]' || fail "perimapd: no version"
