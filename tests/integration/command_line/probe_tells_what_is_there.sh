#!/bin/bash
# perimap probe: what streams and how well; what does not, and the likeliest reason.
# probe_tells_what_is_there.sh PERIMAP RECORDING WORK_FOLDER
set -uo pipefail
perimap=$1 recording=$2 work=$3
port=$((20000 + $$ % 20000))
rm -rf "$work"
mkdir -p "$work"
line=$(mktemp -u "${TMPDIR:-/tmp}/perimap-ecg-XXXXXX")
emulators=
trap 'kill $emulators 2> /dev/null' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}

"$perimap" track "$recording" --csv "$work/tracks.csv" --video "$work/camera.avi" > "$work/track" 2>&1 || fail "no video: $(cat "$work/track")"
"$perimap" emulate ndi=tcp:127.0.0.1:$port cyton="$line" medlab="$line-medlab" --respiration-channel --respiration-period 2 > "$work/emulators" 2>&1 &
emulators=$!
for _ in $(seq 100); do
  [ "$(grep -c ' at ' "$work/emulators")" -eq 3 ] && break
  sleep 0.1
done
cat > "$work/there.toml" << TOML
version = 1
[camera]
device = "video:camera.avi"
frame_rate_hz = 25
[tracker]
protocol = "ndi"
port = "tcp:127.0.0.1:$port"
[ecg]
protocol = "cyton"
port = "$line"
[respiration]
device_channel = 4
TOML
"$perimap" probe "$work/there.toml" --seconds 6 --json > "$work/there.json" 2> "$work/errors" ||
  fail "what is there is not well: $(cat "$work/there.json" "$work/errors")"
# A device of another kind on the port, two that are not there, and a port without modem lines.
cat > "$work/gone.toml" << TOML
version = 1
[camera]
device = "v4l2:/dev/video-that-is-not-there"
[tracker]
protocol = "igtl"
port = "tcp:127.0.0.1:$((port + 1))"
[ecg]
protocol = "bitalino"
port = "$line"
r_trigger = true
r_trigger_port = "$line-medlab"
TOML
"$perimap" probe "$work/gone.toml" --seconds 4 --json > "$work/gone.json" 2> "$work/errors"
[ $? -eq 1 ] || fail "what is not there is well: $(cat "$work/gone.json")"
node - "$work/there.json" "$work/gone.json" << 'END_OF_JS' || fail "the figures"
const assert = require("node:assert/strict");
const [there, gone] = process.argv.slice(2).map(f => JSON.parse(require("fs").readFileSync(f)));
for (const [device, rate] of [["camera", 25], ["tracker", 60], ["ecg", 250]]) {
  assert.equal(there[device].state, "streaming", device);
  assert.ok(Math.abs(there[device].rate_hz - rate) < 0.1 * rate, `${device} at ${there[device].rate_hz} Hz`);
  assert.equal(there[device].invalid, 0, device);
}
const breathing = there.ecg.respiration;
assert.ok(Math.abs(breathing.rate_hz - 250) < 25, `respiration at ${breathing.rate_hz} Hz`);
assert.equal(breathing.channel, 4);
assert.equal(breathing.sensor_off, 0);
assert.ok(Math.abs(breathing.lowest + 1) < 0.1 && Math.abs(breathing.highest - 1) < 0.1, JSON.stringify(breathing));
assert.match(there.tracker.identity, /emulated tracker/);
assert.match(gone.camera.reason, /no such device/);
assert.match(gone.tracker.reason, /refused/);
assert.match(gone.r_trigger.reason, /cannot watch modem lines/);
assert.match(gone.ecg.reason, /wrong baud rate or another device|not a byte/);
for (const device of ["camera", "tracker", "ecg", "r_trigger"]) assert.notEqual(gone[device].state, "streaming", device);
END_OF_JS

# A tracker that takes the connection and says nothing; a session gives it up later than this probe ends.
node -e 'require("net").createServer(s => s.on("error", () => {})).listen(process.argv[1], "127.0.0.1")' $((port + 2)) &
emulators="$emulators $!"
for _ in $(seq 100); do
  (: < "/dev/tcp/127.0.0.1/$((port + 2))") 2> /dev/null && break
  sleep 0.1
done
printf 'version = 1\n[tracker]\nprotocol = "ndi"\nport = "tcp:127.0.0.1:%d"\n' $((port + 2)) > "$work/deaf.toml"
"$perimap" probe "$work/deaf.toml" --seconds 3 > "$work/deaf" 2>&1
[ $? -eq 1 ] && grep -q "why .*no answer yet to INIT:" "$work/deaf" && grep -q "faults .*0 damaged" "$work/deaf" ||
  fail "a tracker that says nothing: $(cat "$work/deaf")"

# A server that does not send the tool that is asked for.
"$perimap" emulate igtl=tcp:127.0.0.1:$((port + 3)) --igtl-message tdata > "$work/igtl" 2>&1 &
emulators="$emulators $!"
for _ in $(seq 100); do
  grep -q ' at ' "$work/igtl" && break
  sleep 0.1
done
printf 'version = 1\n[tracker]\nprotocol = "igtl"\nport = "tcp:127.0.0.1:%d"\nsensor = "Wrong"\n' $((port + 3)) > "$work/name.toml"
"$perimap" probe "$work/name.toml" --seconds 3 > "$work/name" 2>&1
[ $? -eq 1 ] && grep -q "why .*no tool 'Wrong' in 2 s; the server sends Scope" "$work/name" || fail "a tool that is not sent: $(cat "$work/name")"

printf 'version = 1\n[camera]\ndevice = "video:none.avi"\n' > "$work/wrong.toml"
"$perimap" probe "$work/wrong.toml" > "$work/out" 2>&1
[ $? -eq 2 ] && grep -q "none.avi, which is not there" "$work/out" || fail "a missing video: $(cat "$work/out")"
printf 'version = 1\n' > "$work/wrong.toml"
"$perimap" probe "$work/wrong.toml" > "$work/out" 2>&1
[ $? -eq 2 ] && grep -q "names no device" "$work/out" || fail "no device: $(cat "$work/out")"
echo "as promised"
