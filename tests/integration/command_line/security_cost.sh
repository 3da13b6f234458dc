#!/bin/bash
# What DDS Security costs, in one run of the benchmark: from the write of a surface to its receipt in another process the
# median is at most 2.2 times what it is without keys, and releases are as punctual.
# security_cost.sh PERIMAP RECORDING WORK_FOLDER
set -uo pipefail
perimap=$1 recording=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
"$perimap" bench "$recording" --security --settle 5 --seconds 8 --json "$work/bench.json" > "$work/table" 2> "$work/errors" ||
  { echo "FAILED: $(tail -n 3 "$work/errors")"; exit 1; }
node - "$work/bench.json" << 'END'
const runs = JSON.parse(require("fs").readFileSync(process.argv[2])).live;
// Runs with keys and without take turns, so that what disturbs the machine disturbs both; the median of three forgets one.
const median = (secured, figure) => {
  const values = runs.filter((run) => run.name.startsWith(secured ? "with keys" : "without keys")).map(figure).sort((a, b) => a - b);
  return values[Math.floor(values.length / 2)];
};
const both = (figure) => [median(false, figure), median(true, figure)];
const receipt = both((run) => run.write_to_receipt.p50_us);
const write = both((run) => run.dds_write.p50_us);
const release = both((run) => run.release_tardiness.p50_us);
const missing = runs.reduce((sum, run) => sum + run.missing, 0);
console.log(`write to receipt, median: ${receipt[0]} us without keys, ${receipt[1]} us with (${(receipt[1] / receipt[0]).toFixed(2)} times)`);
console.log(`the write itself: ${write[0]} us, ${write[1]} us; release after its deadline: ${release[0]} us, ${release[1]} us; ${missing} missing`);
process.exit(receipt[1] <= 2.2 * receipt[0] && release[1] <= 2.2 * release[0] ? 0 : 1);
END
