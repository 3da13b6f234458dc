#!/bin/bash
# A lockstep replay in single precision maps as many features as one in double, as well, and is not the same.
# single_precision.sh PERIMAP WORK_FOLDER
set -euo pipefail
perimap=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
"$perimap" simulate "$work/heart.mcap" --duration 20 --size 320x240 --tracker-noise 0 2> "$work/stderr" ||
  { cat "$work/stderr"; exit 1; }
for precision in double single; do
  printf 'version = 1\n[estimation]\nprecision = "%s"\n' $precision > "$work/$precision.toml"
  "$perimap" replay "$work/heart.mcap" -c "$work/$precision.toml" --lockstep --json "$work/$precision.json" \
    --samples "$work/$precision.mcap" > /dev/null 2> "$work/stderr" || { cat "$work/stderr"; exit 1; }
done
if cmp -s "$work/double.mcap" "$work/single.mcap"; then
  echo "FAIL the samples are the same: both were computed in one precision"
  exit 1
fi
node - "$work" << 'END'
const fs = require("fs");
const [exact, single] = ["double", "single"].map(
  name => JSON.parse(fs.readFileSync(`${process.argv[2]}/${name}.json`)).accuracy);
let failed = false;
const near = (what, a, b, share) => {
  const ok = a > 0 && Math.abs(b - a) <= share * a;
  console.log(`${ok ? "ok  " : "FAIL"} ${what}: ${a} in double, ${b} in single, at most ${100 * share} % apart`);
  failed ||= !ok;
};
near("features mapped", exact.features_mapped, single.features_mapped, 0.05);
near("features converged", exact.features_converged, single.features_converged, 0.05);
near("positions compared with the truth", exact.settled_error.count, single.settled_error.count, 0.05);
for (const figure of ["median_mm", "p95_mm", "rms_mm"])
  near(`error, ${figure}`, exact.settled_error[figure], single.settled_error[figure], 0.03);
near("NEES/3", exact.settled_mean_nees, single.settled_mean_nees, 0.05);
process.exit(failed ? 1 : 0);
END
rm -f "$work"/*.mcap
