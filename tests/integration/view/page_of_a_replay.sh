#!/bin/bash
# page_of_a_replay.sh SCRIPT PERIMAP PERIMAPD RECORDING WORK_FOLDER [ARGUMENT...]: the page of a perimapd that replays
# RECORDING, by SCRIPT of this folder, which gets the two programs, perimapd's configuration, the domain and the ARGUMENTs.
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
script=$1 perimap=$2 perimapd=$3 recording=$4 work=$5
shift 5
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../needed_programs.sh"
need_programs chromium node
. "$here/../dds/isolated_domain.sh"
rm -rf "$work"
mkdir -p "$work"
printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %d\n' "$recording" "$DOMAIN" > "$work/perimapd.toml"
node "$here/$script" "$perimap" "$perimapd" "$work/perimapd.toml" "$DOMAIN" "$@"
