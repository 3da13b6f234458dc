// What is said of tools: node --test tools_test.mjs
import assert from "node:assert/strict";
import {test} from "node:test";

import {Tools, toolWords} from "../../../daemon/view/page/tools.mjs";

const probe = {tool: "instrument/probe", state: "good", why: "", touches: false, distance_mm: 3.24, deviation_mm: 0.41,
               rate_mm_per_s: -12.3, tip_mm: [1, 2, 3], nearest_mm: [1, 2, 6]};

test("a distance has its deviation and which way it goes", () => {
  assert.deepEqual(toolWords(probe), {state: "good", touches: false, words: "probe 3.2 \u00b1 0.4 mm, coming 12 mm/s"});
  assert.match(toolWords({...probe, rate_mm_per_s: 8}).words, /going 8 mm\/s$/);
  assert.match(toolWords({...probe, rate_mm_per_s: -1.9}).words, /mm$/);
});

test("a touch is a word", () => {
  const told = toolWords({...probe, touches: true, distance_mm: 0.2});
  assert.ok(told.touches);
  assert.match(told.words, /TOUCHES/);
});

test("nothing is told of a tool beside a surface that is not to be used, nor of one whose distance nobody knows", () => {
  for (const [tool, surface] of [[{...probe, touches: true}, "invalid"], [{...probe, state: "invalid", why: "the tracker does not see it", distance_mm: null, touches: true}, "good"]]) {
    const {state, words, touches} = toolWords(tool, surface);
    assert.equal(state, "invalid");
    assert.ok(!touches && !/\d/.test(words), words);
  }
  assert.equal(toolWords({...probe, state: "invalid", why: "the tracker does not see it", distance_mm: null}).words, "probe: the tracker does not see it");
});

test("a good distance from a degraded surface is degraded", () => {
  assert.equal(toolWords(probe, "degraded").state, "degraded");
});

test("the list is written when it changes, and is gone with the tools", () => {
  let written = 0;
  globalThis.document = {createElement: () => ({})};
  const list = {hidden: true, replaceChildren(...items) { ++written; this.items = items; }};
  const tools = new Tools(list);
  tools.show([probe], "good");
  tools.show([{...probe}], "good");
  assert.equal(written, 1);
  assert.ok(!list.hidden && list.items.length === 1);
  tools.show([{...probe, touches: true}], "good");
  assert.equal(list.items[0].className, "good touches");
  tools.show([], "good");
  assert.ok(list.hidden && list.items.length === 0);
});
