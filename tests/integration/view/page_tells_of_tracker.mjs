// node page_tells_of_tracker.mjs PERIMAP DOMAIN TRACKER WORK_FOLDER: the page of a running `perimap view` in headless Chromium,
// while the process TRACKER, which is perimapd's tracker, is killed.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {join} from "node:path";

import {Browser, watchClock} from "./browser.mjs";

const [perimap, domain, tracker, work] = process.argv.slice(2);
const view = spawn(perimap, ["view", "--port", "0", "--domain", domain], {stdio: ["ignore", "pipe", "ignore"]});
const [first] = await once(view.stdout, "data");
const browser = await Browser.open();
process.on("exit", () => {
  for (const child of [view, browser.process]) child?.kill("SIGKILL");
});
const page = await browser.page(String(first).trim());
const text = "document.body.innerText", state = `document.getElementById("state").textContent`;
const trackerState = `document.querySelector('[data-source="tracker"]')?.dataset.state`;
assert.ok(await page.until(`${trackerState} === "ok" && /^(good|degraded)$/.test(${state})`, 120000), await page.evaluate(text));
// What the page says of it, and when, on its own clock: the row of the tracker, and the line of what may be trusted; and
// when the message came that the page has it from.
await page.evaluate(watchClock);
await page.evaluate(`(() => {
  window.said = {};
  const note = () => {
    const now = performance.now();
    if (!["ok", "unknown"].includes(${trackerState})) window.said.row ??= {at: now, came: window.came.status};
    if (/camera pose|tracker/i.test(document.getElementById("trust").innerText)) window.said.words ??= {at: now, came: window.came.surface};
  };
  new MutationObserver(note).observe(document.body, {attributes: true, childList: true, characterData: true, subtree: true});
})()`);
const killed = Date.now();
process.kill(Number(tracker), "SIGKILL");
assert.ok(await page.until("window.said.row && window.said.words", 60000), await page.evaluate(text));
const {said, origin, stoodMs} = await page.evaluate("({said: window.said, origin: performance.timeOrigin, stoodMs: window.stoodMs})");
console.log(`that the tracker was gone stood in its row ${(origin + said.row.at - killed).toFixed(0)} ms after it was unplugged, and ` +
            `above ${(origin + said.words.at - killed).toFixed(0)} ms after it; the page could not run for ${stoodMs.toFixed(0)} ms at most`);
// Half a second is promised of a machine that has nothing else to do; of the page, wherever it can run, that it says at once
// what it is told.
for (const {at, came} of Object.values(said)) assert.ok(at - came <= 100 + 2 * stoodMs, `said ${at - came} ms after it was told`);
assert.notEqual(await page.evaluate(state), "good");
assert.deepEqual(page.complaints, [], "the console complains");
await page.screenshot(join(work, "unplugged.png"));
await browser.close();
process.exit(0);
