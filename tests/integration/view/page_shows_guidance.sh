#!/bin/bash
# page_shows_guidance.sh PERIMAP WORK_FOLDER CYCLONEDDS_XML: the page while a lens is calibrated from a live camera (a recording
# of a board that is played back in step) and a tracker that is emulated.
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
perimap=$1 work=$2
export CYCLONEDDS_URI=file://$3
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../needed_programs.sh"
need_programs chromium node
source "$here/../emulated_devices.sh"
"$perimap" simulate "$work/board.mcap" --scene board --setup-seed 7 --seed 7 --size 640x480 --duration 14 --fps 15 \
  > "$work/simulated" 2>&1 || fail "no recording: $(cat "$work/simulated")"
emulate "$work/board.mcap" --ndi-tools 1
devices_toml "$work/board.mcap" | sed 's/^\[tracker\]/[tracker]\nsensor = "0A"/' > "$work/devices.toml"
node "$here/page_shows_guidance.mjs" "$perimap" $domain "$work" || fail "see above"
