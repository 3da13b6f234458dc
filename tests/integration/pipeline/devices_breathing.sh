#!/bin/bash
# A respiration channel maps breathing: of a recording in lockstep, and of an emulated Cyton's spare input, which perimapd
# sees, listens to and records.
# devices_breathing.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"

# breathes RECORDING: its replay in lockstep with the channel on
printf 'version = 1\n[respiration]\nchannel = true\n' > "$work/channel.toml"
breathes() {
  "$perimap" replay "$1" --lockstep -c "$work/channel.toml" --json "$work/replay.json" > "$work/replay" 2>&1 ||
    fail "$1 does not replay: $(tail -n 3 "$work/replay")"
  node - "$work/replay.json" << 'END' || fail "$1: $(cat "$work/replay")"
const assert = require("node:assert/strict");
const told = JSON.parse(require("fs").readFileSync(process.argv[2]));
assert.equal(told.breath_state, "locked");
assert.equal(told.breath_source, "channel");
assert.ok(Math.abs(told.breath_s - 3) < 0.15, `${told.breath_s} s a breath`);
assert.ok(told.counts.respiration_samples > 1000);
assert.equal(told.counts.respiration_off, 0);
const error = told.accuracy?.settled_error;
console.log(`${told.breath_s} s a breath, ${told.counts.respiration_samples} samples`, error ?? "");
if (error) assert.ok(error.count > 5000 && error.median_mm !== null && error.median_mm < 0.5, "breathing is not mapped");
END
}
breathes "$recording"

emulate "$recording"
{
  devices_toml "$recording"
  printf '[respiration]\nchannel = true\ndevice_channel = 8\n'
  printf '[recording]\nrecord = true\nfolder = "."\n[control]\nsocket = "%s"\n' "$short/control"
} > "$work/devices.toml"
"$perimapd" -c "$work/devices.toml" > "$work/log" 2>&1 &
daemon=$!
started+=($daemon)
: > "$work/status"
while kill -0 $daemon 2> /dev/null; do
  timeout 5 "$perimap" ctl --socket "$short/control" status --json >> "$work/status" 2> /dev/null && echo >> "$work/status"
  sleep 1
done
wait $daemon || fail "perimapd ended with $?: $(tail -n 5 "$work/log")"
grep -q '"respiration_source": *"channel"' "$work/status" || fail "it did not listen: $(tail -n 30 "$work/status")"
grep -q '"respiration": *{' "$work/status" || fail "the status has no such source: $(tail -n 30 "$work/status")"
breathes "$work"/perimap-*.mcap
echo "as promised"
