#!/bin/bash
# Lockstep replay gives the same bytes with 1, 2 and 4 workers, twice each, those bytes hold mapped features,
# and the report has the counts that the status has.
# lockstep_identical.sh PERIMAP RECORDING WORK_FOLDER MINIMUM_FEATURES [CONFIGURATION]
# CONFIGURATION: what the file holds beside its version, as printf takes it.
set -euo pipefail
perimap=$1 recording=$2 work=$3 minimum=$4
rm -rf "$work"
mkdir -p "$work"
printf 'version = 1\n'"${5:-}" > "$work/configuration.toml"
first=
for workers in 1 2 4; do
  for run in a b; do
    samples=$work/$workers$run.mcap
    "$perimap" replay "$recording" -c "$work/configuration.toml" --lockstep --workers $workers --samples "$samples" --json "$work/$workers$run.json" \
      > /dev/null 2> "$work/stderr" || { cat "$work/stderr"; exit 1; }
    if [ -z "$first" ]; then
      first=$samples
    elif ! cmp "$first" "$samples"; then
      echo "samples differ: $workers workers, run $run"
      exit 1
    fi
  done
done
mapped=$(sed -n 's/.*"features_mapped": \([0-9]*\).*/\1/p' "$work/1a.json" | head -n 1)
echo "identical; $mapped features mapped"
[ "$mapped" -ge "$minimum" ]
# What the status of a live run counts, the report does; no release is late on the recording's own clock.
grep -q '"starts_failed_outliers":' "$work/1a.json"
grep -q '"releases_late": 0,\?$' "$work/1a.json"
if grep '"releases_late": [1-9]' "$work/1a.json"; then exit 1; fi
