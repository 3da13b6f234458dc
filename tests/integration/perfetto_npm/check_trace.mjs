// check_trace.mjs TRACE_PROCESSOR_FOLDER TRACE BENCH: what Perfetto makes of the trace is what `perimap bench` measured.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { openTrace } from "./trace_processor.mjs";

const [folder, file, bench] = process.argv.slice(2);
const figures = JSON.parse(readFileSync(bench)).live;
const trace = await openTrace(folder, file);

// Nothing was refused, dropped or put right.
assert.deepEqual(await trace.query("select name, value from stats where severity in ('error', 'data_loss') and value > 0"), []);

const threads = await trace.query(`select process.name as process, thread.name as thread from thread join process using (upid)
  where thread.name is not null and thread.name != process.name order by process.upid, thread.tid`);
const names = ["source", "mapper", "publisher", "worker-0", "worker-1"];
assert.deepEqual(threads.map(({ thread }) => thread), figures.flatMap(() => names));

const middle = (values) => values.sort((a, b) => a - b)[Math.floor((values.length - 1) / 2)];
for (const run of figures) {
  const process = `${run.part}: ${run.name}`;
  const slices = `slice join thread_track on slice.track_id = thread_track.id join thread using (utid)
    join process using (upid) where process.name = '${process}'`;
  const durations = async (thread, name) => (await trace.query(
    `select slice.dur as dur from ${slices} and thread.name = '${thread}' and slice.name = '${name}'`)).map(({ dur }) => dur);

  // As many surfaces, and as long a write.
  const writes = await durations("publisher", "write");
  assert.equal(writes.length, run.sent, `${process}: surfaces`);
  const off = Math.abs(middle(writes) / 1e3 - run.dds_write.p50_us);
  assert.ok(off < 20, `${process}: a write takes ${middle(writes) / 1e3} us, ${run.dds_write.p50_us} in the figures`);
  // The stages, whose figures are right to 1/16; their first tenth of a second does not count.
  for (const name of ["predict and find", "phase and pose", "evaluate"]) {
    const took = (await durations("mapper", name)).slice(-run.stages[name].count);
    assert.ok(run.stages[name].count > 40, `${process}: ${name} was measured ${run.stages[name].count} times`);
    assert.equal(took.length, run.stages[name].count, name);
    const us = middle(took) / 1e3, told = run.stages[name].p50_us;
    assert.ok(Math.abs(us - told) < 0.08 * told + 1, `${process}: ${name} takes ${us} us, ${told} in the figures`);
  }
  // Each stage lies in its frame, one after the other, and with the others fills it.
  const [{ stages, outside }] = await trace.query(`select count(*) as stages, sum(parent.name is not 'frame') as outside
    from slice left join slice parent on slice.parent_id = parent.id where slice.id in (select slice.id from ${slices}
    and thread.name = 'mapper' and slice.name in ('predict and find', 'phase and pose', 'evaluate', 'settle matches', 'hand on'))`);
  const frames = await durations("mapper", "frame");
  assert.equal(stages, 5 * frames.length);
  assert.equal(outside, 0);
  const [{ rest }] = await trace.query(`select max(abs(f.dur - (select sum(dur) from slice s where s.parent_id = f.id))) as rest
    from slice f where f.id in (select slice.id from ${slices} and thread.name = 'mapper' and slice.name = 'frame')`);
  assert.equal(rest, 0, "a part of a frame is told of by no stage");
  // A worker's stages lie within the mapper's of that frame, which waits for all of them.
  const late = await trace.query(`with own as (select slice.*, thread.name as thread, extract_arg(slice.arg_set_id, 'args.frame') as frame from ${slices})
    select w.name, w.frame from own w join own m on m.thread = 'mapper' and m.name = w.name and m.frame = w.frame
    where w.thread like 'worker-%' and (w.ts < m.ts or w.ts + w.dur > m.ts + m.dur)`);
  assert.deepEqual(late, [], "a worker's stage outside of the mapper's");
  for (const worker of ["worker-0", "worker-1"]) {
    assert.equal((await durations(worker, "evaluate")).length, frames.length, `${process}: ${worker}`);
    assert.ok((await durations(worker, "learn")).length >= frames.length - 1);
  }
}

// Each frame by itself, from its capture to its surface: its parts lie within it, and it is released once.
const lives = await trace.query(`select slice.id, slice.dur, extract_arg(slice.arg_set_id, 'args.frame') as frame,
  (select count(*) from slice part where part.parent_id = slice.id and part.name = 'released') as released,
  (select sum(dur) from slice part where part.parent_id = slice.id) as parts
  from slice where name = 'frame' and category = 'frame'`);
assert.ok(lives.length >= figures.length * 60, `${lives.length} frames`);
assert.ok(lives.filter(({ released }) => released === 1).length >= 0.8 * lives.length, "frames are released");
for (const { frame, dur, parts, released } of lives) {
  assert.ok(parts <= dur && released <= 1, `frame ${frame}`);
  if (released === 1) assert.ok(dur >= 50e6, `frame ${frame} was released after ${dur} ns`);
}
// Arrows from thread to thread.
const [{ arrows }] = await trace.query("select count(*) as arrows from flow");
assert.ok(arrows >= 1.5 * lives.length, `${arrows} arrows between ${lives.length} frames`);
trace.close();
console.log(`${lives.length} frames, ${arrows} arrows: as measured`);
process.exit(0);
