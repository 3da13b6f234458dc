#!/bin/bash
# Lockstep replay of a simulated recording reaches the accuracy that is promised for it.
# accuracy.sh PERIMAP WORK_FOLDER SIMULATE_OPTION... -- KEY LIMIT [KEY LIMIT ...]
# A KEY with a leading - is a lower bound. Keys: those of the report's "accuracy" and of its "settled_error".
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
node - "$work/report.json" "$@" << 'END'
const report = JSON.parse(require("fs").readFileSync(process.argv[2])).accuracy;
const values = {...report.settled_error, ...report};
let failed = false;
for (let i = 3; i < process.argv.length; i += 2) {
  const lower = process.argv[i].startsWith("-");
  const key = process.argv[i].replace(/^-/, "");
  const limit = Number(process.argv[i + 1]);
  // null, the figure of nothing, would count as 0.
  const ok = typeof values[key] === "number" && (lower ? values[key] >= limit : values[key] <= limit);
  console.log(`${ok ? "ok  " : "FAIL"} ${key} = ${values[key]}, ${lower ? "at least" : "at most"} ${limit}`);
  failed ||= !ok;
}
process.exit(failed ? 1 : 0);
END
rm -f "$work/heart.mcap"
