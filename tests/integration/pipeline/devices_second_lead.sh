#!/bin/bash
# Two leads of an emulated Cyton, of which the first comes off again and again: the phase goes on, status and log say which
# lead is off, and the recording holds both.
# devices_second_lead.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"

start=$(awk '{printf "%.3f", $1 + 8}' /proc/uptime)
"$perimap" emulate ndi=tcp:127.0.0.1:$port --recording "$recording" --start "$start" > "$work/tracker" 2>&1 &
started+=($!)
"$perimap" emulate cyton="$line" --recording "$recording" --start "$start" --second-lead --missing 14 7 \
  > "$work/ecg" 2>&1 &
started+=($!)
{
  devices_toml "$recording"
  printf '[recording]\nrecord = true\nfolder = "."\n[control]\nsocket = "%s"\n' "$short/control"
} | sed 's/^protocol = "cyton"/&\nsecond_channel = 2/' > "$work/devices.toml"
"$perimapd" -c "$work/devices.toml" > "$work/log" 2>&1 &
daemon=$!
started+=($daemon)
: > "$work/status"
while kill -0 $daemon 2> /dev/null; do
  timeout 5 "$perimap" ctl --socket "$short/control" status --json 2> /dev/null | tr -d '\n ' >> "$work/status" &&
    echo >> "$work/status"
  sleep 0.5
done
wait $daemon || fail "perimapd ended with $?: $(tail -n 5 "$work/log")"
grep -q '"ecg_leads":\["good","good"\]' "$work/status" || fail "two good leads are not told: $(tail -n 2 "$work/status")"
off='"ecg_leads":\["\(flat\|off\)","good"\]'
told=$(grep -c "$off" "$work/status")
[ "$told" -ge 4 ] || fail "that the first lead is off is told $told times: $(tail -n 2 "$work/status")"
# While it is off the beats of the other lead carry the phase.
locked=$(grep "$off" "$work/status" | grep -c '"phase":"locked"')
[ $((10 * locked)) -ge $((9 * told)) ] || fail "with one lead the phase is locked in $locked of $told samples"
grep -q 'the first lead of the ECG is' "$work/log" || fail "the log does not say so: $(tail -n 5 "$work/log")"
grep -q 'the first lead of the ECG is heard again' "$work/log" || fail "nor that it is back"
"$perimap" ecg "$work"/perimap-*.mcap > "$work/beats" 2>&1 || fail "its ECG is not read: $(cat "$work/beats")"
grep -q 'first lead: unusable for [1-9]' "$work/beats" || fail "of the recording it is not told: $(cat "$work/beats")"
grep -q 'second lead: unusable for 0.0 s' "$work/beats" || fail "the second was never off: $(cat "$work/beats")"
echo "as promised: off in $told samples of the status"
