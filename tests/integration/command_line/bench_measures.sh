#!/bin/bash
# `perimap bench` over a short recording: what it reports is there and goes together, and errors are said in one line.
# Absolute times are not judged.
#   bench_measures.sh PERIMAP RECORDING FOLDER
set -uo pipefail
perimap=$1
recording=$2
out=$3
rm -rf "$out"
mkdir -p "$out/scratch"

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

"$perimap" bench "$recording" --only live --runs 1 --settle 0.5 --seconds 1.5 --features 40 --scratch "$out/scratch" \
  --json "$out/bench.json" --html "$out/bench.html" > "$out/table" 2> "$out/progress" || fail "exit code $?: $(cat "$out/progress")"

# number OF_RUN PATH.TO.KEY: from the JSON.
number() {
  node -e 'const [file, run, path] = process.argv.slice(1);
    let value = JSON.parse(require("fs").readFileSync(file)).live[run];
    for (const key of path.split(".")) value = value[key];
    console.log(value)' "$out/bench.json" "$@"
}
runs=$(node -e 'console.log(JSON.parse(require("fs").readFileSync(process.argv[1])).live.length)' "$out/bench.json")
permitted=$(grep -c '"realtime_permitted": true' "$out/bench.json")
[ "$runs" -eq $((1 + permitted)) ] || fail "$runs runs, SCHED_FIFO permitted: $permitted"
for ((run = 0; run < runs; ++run)); do
  sent=$(number $run sent)
  # 1.5 s at 30 frames/s.
  if [ "$sent" -lt 30 ] || [ "$sent" -gt 55 ]; then fail "run $run: $sent surfaces"; fi
  [ "$(number $run release_tardiness.count)" -eq "$sent" ] || fail "run $run: not every release is counted"
  received=$(number $run write_to_receipt.count)
  [ $((received + $(number $run missing))) -eq "$sent" ] || fail "run $run: $received received and $(number $run missing) missing are not $sent"
  [ "$received" -gt 0 ] || fail "run $run: nothing was received"
  # Two waits a release, but for those that the machine kept from being taken.
  bare=$(number $run bare_loop.count)
  if [ $((2 * bare)) -lt "$sent" ] || [ "$bare" -gt $((2 * sent + 5)) ]; then fail "run $run: $bare bare waits beside $sent releases"; fi
  for figures in release_tardiness bare_loop dds_write capture_to_release capture_to_receipt write_to_receipt; do
    node -e 'const [p50, p99, p999, max] = process.argv.slice(1).map(Number);
      process.exit(p50 <= p99 && p99 <= p999 && p999 <= max ? 0 : 1)' \
      "$(number $run $figures.p50_us)" "$(number $run $figures.p99_us)" "$(number $run $figures.p999_us)" \
      "$(number $run $figures.max_us)" || fail "run $run: percentiles of $figures are not in order"
  done
  # Fixed latency: 50 ms is when it is released at the earliest.
  node -e 'process.exit(Number(process.argv[1]) >= 50000 ? 0 : 1)' "$(number $run capture_to_release.p50_us)" ||
    fail "run $run: released before capture + 50 ms"
done
grep -q 'do not prove' "$out/table" || fail "the table does not say what it does not prove"
grep -q '</html>' "$out/bench.html" || fail "the page is not whole"
if grep -oE '(src|href)=' "$out/bench.html"; then fail "the page refers to something outside"; fi
[ -z "$(ls -A "$out/scratch")" ] || fail "left behind: $(ls "$out/scratch")"
"$perimap" --help | grep -q bench-subscriber && fail "the subscriber's command is shown to users"

expect() { # EXIT_CODE ARGUMENT...
  local code=$1
  shift
  "$perimap" bench "$@" > /dev/null 2> "$out/error"
  local got=$?
  [ $got -eq "$code" ] || fail "'bench $*' ended with $got in place of $code"
}
expect 2
expect 2 "$recording" --only nothing-of-the-kind
expect 2 "$recording" --runs 0
expect 1 "$out/no-such.mcap"
grep -q "^perimap bench: .*$out/no-such.mcap" "$out/error" || fail "the error does not name the recording"
expect 1 "$recording" --scratch "$out/no-such-folder"
exit 0
