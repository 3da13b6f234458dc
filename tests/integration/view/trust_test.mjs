// What the page says may be trusted: node --test trust_test.mjs
import assert from "node:assert/strict";
import {test} from "node:test";

import {Held, judge, kHeldMs, kSilenceMs, Lag, usesOf, worse} from "../../../daemon/view/page/trust.mjs";

const good = {state: "good", permission: "may be used", why: "", remedy: "", source: "perimapd", valid_for_ms: 1000};
const sentence = ({permission, why, remedy}) => `${permission}: ${why}; ${remedy}`;
const live = {link: {open: true, words: ""}, domain: 3, publishers: 1, surface: good, ageMs: 10, lagMs: 0, recorded: false};

test("a new surface is what it says", () => {
  assert.equal(judge(live).state, "good");
  const degraded = {...good, state: "degraded", permission: "use with care", why: "no pose of the scope", remedy: "look at the tracker"};
  const judged = judge({...live, surface: degraded});
  assert.equal(judged.state, "degraded");
  assert.equal(sentence(judged), "use with care: no pose of the scope; look at the tracker");
});

test("half a second without one and nothing may be used", () => {
  assert.ok(kSilenceMs < 500);
  assert.equal(judge({...live, ageMs: kSilenceMs}).state, "good");
  const silent = judge({...live, ageMs: 450});
  assert.equal(silent.state, "invalid");
  assert.match(sentence(silent), /use no position: nothing has come from perimapd for 0\.[45] s/);
});

test("an old, late or unknown surface is never good", () => {
  assert.equal(judge({...live, lagMs: 450}).state, "invalid");
  assert.equal(judge({...live, lagMs: 250, ageMs: 250}).state, "invalid", "late and old together");
  assert.equal(judge({...live, surface: {...good, valid_for_ms: 9}}).state, "invalid", "not to be used any more");
  assert.equal(judge({...live, surface: {...good, valid_for_ms: -1}}).state, "invalid", "came after its time");
  for (const state of ["invalid", "unknown", "", undefined]) {
    assert.equal(judge({...live, surface: {...good, state}}).state, "invalid");
  }
});

test("nobody there, no link and no surface are told apart", () => {
  assert.match(sentence(judge({...live, surface: null, publishers: 0})), /nobody publishes in DDS domain 3/);
  assert.match(sentence(judge({...live, surface: null})), /no surface has come yet/);
  const link = {open: false, words: "16 pages are open already"};
  assert.match(sentence(judge({...live, link})), /16 pages are open already/);
  assert.equal(judge({...live, link}).state, "invalid");
});

test("while the set-up is measured that is why there is no surface, and a surface is judged by itself", () => {
  const measured = judge({...live, surface: null, publishers: 0, calibrating: "calibrate camera"});
  assert.equal(measured.state, "invalid");
  assert.match(sentence(measured), /the set-up is being measured: calibrate camera/);
  assert.equal(judge({...live, calibrating: "calibrate camera"}).state, "good");
  assert.match(sentence(judge({...live, ageMs: 450, calibrating: "calibrate camera"})), /nothing has come from perimapd/);
});

test("a recording's gap is one", () => {
  const recorded = {...live, recorded: true, publishers: null};
  assert.equal(judge(recorded).state, "good");
  assert.match(sentence(judge({...recorded, ageMs: 2000})), /nothing was published for 2.0 s/);
  assert.match(sentence(judge({...recorded, surface: null})), /no surface here/);
});

test("what is worse stays on the page until it can be read", () => {
  const held = new Held();
  const [well, care, none] = ["good", "degraded", "invalid"].map((state) => ({state}));
  assert.equal(held.take(well, 0), well);
  assert.equal(held.take(care, 10), care);
  assert.equal(held.take(well, 10 + kHeldMs), care);
  assert.equal(held.take(none, 20), none);
  assert.equal(held.take(care, 30), none);
  assert.equal(held.take(well, 21 + kHeldMs), well);
});

const uses = {display: {state: "good", within_mm: 5, features: 31}, measure: {state: "good", within_mm: 3, features: 30},
              contact: {state: "degraded", within_mm: 2, features: 4}};

test("what a surface may be used for is told of each use, and a degraded surface may be good to show", () => {
  const judged = judge({...live, surface: {...good, state: "degraded", uses}});
  assert.deepEqual(judged.uses, [{state: "good", words: "\u2713 show it: 31 within 5 mm"},
                                 {state: "good", words: "\u2713 measure in it: 30 within 3 mm"},
                                 {state: "degraded", words: "! touch it: 4 within 2 mm"}]);
  assert.deepEqual(judge({...live, publishers: 2, surface: {...good, uses}}).uses.map(({state}) => state),
                   ["degraded", "degraded", "degraded"]);
  assert.equal(usesOf({uses: {contact: {state: "new"}}}, "good")[0].state, "invalid");
});

test("of what is not to be trusted no use is told, and an older perimapd tells of none", () => {
  for (const untrusted of [{ageMs: 450}, {sameSource: true}, {link: {open: false, words: ""}}, {surface: {...good, state: "invalid", uses}}]) {
    assert.equal(judge({...live, surface: {...good, uses}, ...untrusted}).uses, undefined);
  }
  for (const older of [null, undefined]) assert.deepEqual(judge({...live, surface: {...good, uses: older}}).uses, []);
});

test("a use that is worse for one frame stays on the page until it can be read", () => {
  const held = new Held(), all = {state: "good", uses: [{state: "good"}]}, less = {state: "good", uses: [{state: "degraded"}]};
  held.take(all, 0);
  assert.equal(held.take(less, 10), less);
  assert.equal(held.take(all, kHeldMs), less);
  assert.equal(held.take(all, 11 + kHeldMs), all);
});

test("what is missing is not trusted", () => {
  for (const missing of ["ageMs", "lagMs"]) {
    assert.equal(judge({...live, [missing]: undefined}).state, "invalid", missing);
    assert.equal(judge({...live, [missing]: NaN}).state, "invalid", missing);
  }
  for (const missing of ["valid_for_ms", "state"]) {
    assert.equal(judge({...live, surface: {...good, [missing]: undefined}}).state, "invalid", missing);
    assert.equal(judge({...live, surface: {...good, [missing]: null}}).state, "invalid", missing);
  }
});

test("of two perimapds no surface is good", () => {
  const judged = judge({...live, publishers: 2});
  assert.equal(judged.state, "degraded");
  assert.match(judged.why, /2 perimapds publish here: 'perimapd' is shown/);
  assert.ok(judged.contested, "said twice");
  assert.equal(judge({...live, publishers: 2, surface: {...good, state: "invalid"}}).state, "invalid");
  const same = judge({...live, publishers: 2, sameSource: true});
  assert.equal(same.state, "invalid");
  assert.match(same.why, /two perimapds publish as 'perimapd'/);
});

test("lag is what is beyond the quickest, and clocks that drift are no lag", () => {
  const lag = new Lag();
  assert.equal(lag.take(1000, 5010), 0);
  assert.equal(lag.take(1100, 5200), 90);
  // A second in ten minutes, a hundred times what clocks drift.
  let most = 0;
  for (let at = 0; at < 6e5; at += 33) most = Math.max(most, lag.take(1100 + at, 5200 + at * (1 + 1 / 600)));
  assert.ok(most < 400, `${most} ms`);
});

test("a mesh is no better than its surface, nor the surface's mesh than itself", () => {
  assert.equal(worse("good", "degraded"), "degraded");
  assert.equal(worse("degraded", "good"), "degraded");
  assert.equal(worse("good", undefined), undefined);
});
