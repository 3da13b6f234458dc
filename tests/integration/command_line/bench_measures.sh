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

"$perimap" bench "$recording" --only live,memory --runs 1 --settle 0.5 --seconds 1.5 --features 40 --frames 400 \
  --scratch "$out/scratch" --json "$out/bench.json" --html "$out/bench.html" --trace "$out/trace.json" > "$out/table" 2> "$out/progress" ||
  fail "exit code $?: $(cat "$out/progress")"

if grep -v '^perimap bench: ' "$out/progress"; then fail "a line without the program's name"; fi

node - "$out/bench.json" "$out/trace.json" << 'END' || fail "the figures do not go together"
const json = JSON.parse(require('fs').readFileSync(process.argv[2]));
let failed = 0;
function expect(holds, text) {
  if (!holds) console.error(text);
  failed += holds ? 0 : 1;
}
expect(json.live.length === (json.machine.realtime_permitted ? 2 : 1), `${json.live.length} runs`);
for (const run of json.live) {
  const name = run.name;
  // 1.5 s at 30 frames/s.
  expect(run.sent >= 30 && run.sent <= 55, `${name}: ${run.sent} surfaces`);
  expect(run.release_tardiness.count === run.sent, `${name}: not every release is counted`);
  expect(run.releases_late >= 0, `${name}: how many were late is not told`);
  const received = run.write_to_receipt.count;
  expect(received > 0, `${name}: nothing was received`);
  expect(received + run.missing === run.sent, `${name}: ${received} received, ${run.missing} missing, ${run.sent} sent`);
  // Two waits a release, but for those that the machine kept from being taken.
  const bare = run.bare_loop.count;
  expect(2 * bare >= run.sent && bare <= 2 * run.sent + 5, `${name}: ${bare} bare waits beside ${run.sent} releases`);
  for (const key of ['release_tardiness', 'bare_loop', 'dds_write', 'capture_to_release', 'capture_to_receipt',
    'write_to_receipt']) {
    const f = run[key];
    expect(f.p50_us <= f.p99_us && f.p99_us <= f.p999_us && f.p999_us <= f.max_us, `${name}: ${key} is not in order`);
  }
  expect(run.capture_to_release.p50_us >= 50000, `${name}: released before capture + 50 ms`);
  expect(run.stages['predict and find'].count > 0, `${name}: no stage was measured`);
}
// Each run is a process of the trace; the surfaces from where the figures begin are those that they count.
const trace = JSON.parse(require('fs').readFileSync(process.argv[3])).traceEvents;
const runs = trace.filter((event) => event.name === 'process_name');
expect(runs.length === json.live.length, `${runs.length} runs in the trace`);
for (const [i, run] of json.live.entries()) {
  const own = trace.filter(({ pid }) => pid === runs[i].pid);
  expect(runs[i].args.name === `${run.part}: ${run.name}`, `a run is called ${runs[i].args.name}`);
  const from = own.find(({ name }) => name === 'counted from here').ts;
  const written = own.filter(({ ph, name, ts, args }) => ph === 'X' && name === 'write' && ts - args.after_deadline_us >= from - 0.002);
  expect(written.length === run.sent, `${written.length} surfaces in the trace, ${run.sent} counted`);
  const total = written.reduce((sum, { dur }) => sum + dur, 0);
  expect(total >= run.sent * run.dds_write.p50_us / 2, `the writes of the trace take ${total} us`);
  const lateness = written.map(({ args }) => args.after_deadline_us).sort((a, b) => a - b)[Math.floor((written.length - 1) / 2)];
  expect(Math.abs(lateness - run.release_tardiness.p50_us) < 20, `half of them are ${lateness} us late or less`);
}
// 180 frames a round.
expect(json.memory.frames >= 400 && json.memory.frames <= 402, `${json.memory.frames} frames in lockstep`);
expect(json.memory.rounds === 3, `${json.memory.rounds} rounds`);
expect(json.memory.readings.every((r) => r.resident_kB > 1000), 'memory was not read');
process.exit(failed === 0 ? 0 : 1);
END
"$perimap" bench "$recording" --trace "$out/no-such-folder/trace.json" > /dev/null 2> "$out/error" &&
  fail "a trace that cannot be written is no error"
grep -q 'no-such-folder' "$out/error" || fail "the error does not name the trace"
"$perimap" bench "$recording" --json "$out/one" --trace "$out/one" > /dev/null 2>&1
[ $? -eq 2 ] || fail "one file for two outputs is no wrong usage"
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
