#!/bin/bash
# page_tells_of_tracker.sh PERIMAP PERIMAPD RECORDING WORK_FOLDER CYCLONEDDS_XML: the page while the tracker of a perimapd over
# emulated devices is unplugged.
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
perimap=$1 perimapd=$2 recording=$3 work=$4
export CYCLONEDDS_URI=file://$5
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../needed_programs.sh"
need_programs chromium node
source "$here/../emulated_devices.sh"
# Each device is a program of its own, so that one can be taken away.
start=$(awk '{printf "%.3f", $1 + 8}' /proc/uptime)
"$perimap" emulate ndi=tcp:127.0.0.1:$port --recording "$recording" --start "$start" > "$work/tracker" 2>&1 &
tracker=$!
"$perimap" emulate cyton="$line" --recording "$recording" --start "$start" > "$work/ecg" 2>&1 &
started=($tracker $!)
devices_toml "$recording" > "$work/devices.toml"
"$perimapd" -c "$work/devices.toml" 2> "$work/log" &
started+=($!)
node "$here/page_tells_of_tracker.mjs" "$perimap" $domain $tracker "$work" || fail "see above; $(tail -n 5 "$work/log")"
