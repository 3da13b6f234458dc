#!/bin/bash
# page_shows_recording.sh PERIMAP RECORDING WORK_FOLDER
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
perimap=$1 recording=$2 work=$3
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../needed_programs.sh"
need_programs chromium node
rm -rf "$work"
mkdir -p "$work"
"$perimap" replay "$recording" --lockstep --samples "$work/samples.mcap" > "$work/replay" 2>&1 || exit 1
head -c $(($(stat -c %s "$work/samples.mcap") * 3 / 4)) "$work/samples.mcap" > "$work/cut.mcap"
node "$here/page_shows_recording.mjs" "$perimap" "$recording" "$work/samples.mcap" "$work/cut.mcap" "$work"
