#!/bin/bash
# perimap emulate refuses what a device cannot do, and has a patient's reference where it is told; perimap record takes any
# device, be it a trigger line alone.
# emulate_and_record_devices.sh PERIMAP RECORDED_POSES WORK_FOLDER
set -uo pipefail
perimap=$1 recorded_poses=$2 work=$3
port=$((20000 + $$ % 20000))
rm -rf "$work"
mkdir -p "$work"
emulator=
trap 'kill $emulator 2> /dev/null' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}

# refused TEXT ARGUMENT...: at once, with exit code 2 and the text on one line
refused() {
  local text=$1
  shift
  timeout 10 "$perimap" emulate "$@" > "$work/out" 2> "$work/error"
  [ $? -eq 2 ] || fail "emulate $*: ended otherwise: $(cat "$work/out" "$work/error")"
  [ "$(wc -l < "$work/error")" -eq 1 ] && grep -qF -e "$text" "$work/error" || fail "emulate $*: $(cat "$work/error")"
}
for option in --bad-check --garbled --truncated; do
  refused "device 'can-ecg': cannot do $option" ndi=tcp:127.0.0.1:$port can-ecg=can:none $option 0.1
done
for option in --bad-check --garbled; do
  refused "device 'camera': cannot do $option" camera=v4l2:/dev/video-that-is-not-there $option 0.1
done
refused "--can-...: expected the device 'can-ecg'" ndi=tcp:127.0.0.1:$port --can-rate 500
refused "--can-identifier: expected at most 0x7FF without --can-extended, got 0x800" can-ecg=can:none --can-identifier 0x800
refused "device 'ndi': listens on this host alone" ndi=tcp:192.0.2.7:$port
refused "--ndi-reference: expected a rotation" ndi=tcp:127.0.0.1:$port --ndi-reference 0 0 -500 1 1 0 0

"$perimap" emulate ndi=tcp:127.0.0.1:$port --ndi-reference 10 0 -520 0.70711 0 0 0.70711 > "$work/emulator" 2>&1 &
emulator=$!
for _ in $(seq 100); do
  grep -q ' at ' "$work/emulator" && break
  sleep 0.1
done
cat > "$work/reference.toml" << TOML
version = 1
[tracker]
protocol = "ndi"
port = "tcp:127.0.0.1:$port"
frame_rate_hz = 60
reference = "0B"
TOML
"$perimap" record -c "$work/reference.toml" "$work/reference.mcap" --seconds 2 > "$work/record" 2>&1 ||
  fail "a tracker alone: $(cat "$work/record")"
# The emulated scope goes round (0, 0, -500) of the tracker, 20 mm off; from the reference, which is turned by 90 degrees
# about the tracker's z axis, that is a circle about (0, 10, 20).
"$recorded_poses" "$work/reference.mcap" > "$work/poses" || fail "its poses cannot be read"
awk '
  { off = sqrt(($3 - 20) ^ 2 + (sqrt($1 ^ 2 + ($2 - 10) ^ 2) - 20) ^ 2); if (off > most) most = off }
  END { printf "%d poses, at most %.4f mm off their place\n", NR, most; exit !(NR >= 20 && most < 0.1) }
' "$work/poses" || fail "the reference is elsewhere: $(head -n 3 "$work/poses")"
"$perimap" probe "$work/reference.toml" --seconds 2 --json > "$work/probe.json" 2> "$work/error" ||
  fail "the reference is not seen: $(cat "$work/probe.json" "$work/error")"
node - "$work/probe.json" << 'END' || fail "poses relative to the reference: $(cat "$work/probe.json")"
const assert = require("node:assert/strict");
const {tracker} = JSON.parse(require("fs").readFileSync(process.argv[2]));
assert.equal(tracker.state, "streaming");
assert.equal(tracker.invalid, 0);
END

# A line that is not there is waited for, and that nothing came is said at the end.
printf 'version = 1\n[ecg]\nr_trigger = true\nr_trigger_port = "/dev/tty-that-is-not-there"\n' > "$work/trigger.toml"
"$perimap" record -c "$work/trigger.toml" "$work/trigger.mcap" --seconds 0.5 > "$work/record" 2>&1
[ $? -eq 1 ] && grep -q "0 messages recorded" "$work/record" && grep -q "no device gave anything" "$work/record" ||
  fail "a trigger alone: $(cat "$work/record")"
[ -s "$work/trigger.mcap" ] || fail "nothing was written: $(cat "$work/record")"
echo 'version = 1' > "$work/none.toml"
"$perimap" record -c "$work/none.toml" "$work/none.mcap" --seconds 0.5 > "$work/record" 2>&1
[ $? -eq 2 ] && grep -q "names no device" "$work/record" || fail "no device: $(cat "$work/record")"
echo "as promised"
