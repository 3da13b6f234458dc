// What the page shows of a calibration: node --test guidance_test.mjs
import assert from "node:assert/strict";
import {test} from "node:test";

import {Guidance, kOverMs, kRecordedMs, partsOf} from "../../../daemon/view/page/guidance.mjs";

const recording = {what: "calibrate camera", line: "12 views; show it upper left", stage: "recording", columns: 3, rows: 3,
                   seen_percent: [0, 100, 100, 40, 100, 100, 100, 100, 99], elapsed_s: 4, longest_s: 60};

test("parts lie row by row over the whole picture, and less than all that is wanted is not enough", () => {
  const parts = partsOf(recording, 300, 150);
  assert.equal(parts.length, 9);
  assert.deepEqual([parts[5].x, parts[5].y, parts[5].width, parts[5].height], [200, 50, 100, 50]);
  assert.deepEqual(parts.map(({enough}) => enough), [false, true, true, false, true, true, true, true, false]);
});

test("where parts do not matter there are none", () => {
  assert.deepEqual(partsOf({...recording, columns: 0, rows: 0, seen_percent: []}, 300, 150), []);
});

test("what is not told any more is over; what was recorded stays while it is measured", () => {
  const guidance = new Guidance({});
  assert.equal(guidance.what(0), "");
  guidance.take(recording, 1000);
  assert.equal(guidance.what(1000 + kOverMs), "calibrate camera");
  assert.equal(guidance.what(1001 + kOverMs), "");
  guidance.take({...recording, stage: "recorded"}, 5000);
  assert.equal(guidance.what(5000 + kRecordedMs), "calibrate camera");
  assert.equal(guidance.what(5001 + kRecordedMs), "");
});
