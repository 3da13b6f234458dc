#!/bin/bash
# Lockstep replay of a simulated recording reaches the accuracy that is promised for it.
# accuracy.sh PERIMAP WORK_FOLDER SIMULATE_OPTION... -- KEY LIMIT [KEY LIMIT ...]
# A KEY with a leading - is a lower bound. Keys: median_mm p95_mm features_converged_by_15_s
set -euo pipefail
perimap=$1 work=$2
shift 2
simulate=()
while [ "$1" != -- ]; do
  simulate+=("$1")
  shift
done
shift
rm -rf "$work"
mkdir -p "$work"
"$perimap" simulate "$work/heart.mcap" "${simulate[@]}" 2> "$work/stderr" || { cat "$work/stderr"; exit 1; }
"$perimap" replay "$work/heart.mcap" --lockstep --json "$work/report.json" 2> "$work/stderr" || { cat "$work/stderr"; exit 1; }
python3 - "$work/report.json" "$@" << 'END'
import json, sys
report = json.load(open(sys.argv[1]))["accuracy"]
values = {**report["settled_error"], **report}
failed = False
for key, limit in zip(sys.argv[2::2], sys.argv[3::2]):
    lower = key.startswith("-")
    value, limit = values[key.lstrip("-")], float(limit)
    ok = value >= limit if lower else value <= limit
    print(f"{'ok  ' if ok else 'FAIL'} {key.lstrip('-')} = {value:g}, {'at least' if lower else 'at most'} {limit:g}")
    failed |= not ok
sys.exit(failed)
END
rm -f "$work/heart.mcap"
