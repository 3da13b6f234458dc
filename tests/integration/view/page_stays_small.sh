#!/bin/bash
# page_stays_small.sh PERIMAP PERIMAPD RECORDING WORK_FOLDER [MINUTES]: four pages, for ten minutes unless told otherwise.
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
perimap=$1 perimapd=$2 recording=$3 work=$4 minutes=${5:-10}
here=$(cd "$(dirname "$0")" && pwd)
for program in chromium node; do
  if ! command -v $program > /dev/null; then
    echo "SKIPPED: $program is not installed"
    exit 77
  fi
done
. "$here/../dds/isolated_domain.sh"
rm -rf "$work"
mkdir -p "$work"
printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %d\n' "$recording" "$DOMAIN" > "$work/perimapd.toml"
node "$here/page_stays_small.mjs" "$perimap" "$perimapd" "$work/perimapd.toml" "$DOMAIN" "$minutes"
