// node page_follows_perimapd.mjs PERIMAP PERIMAPD CONFIGURATION DOMAIN WORK_FOLDER: the page of a running `perimap view`,
// opened in headless Chromium while perimapd starts, publishes and is killed. perimapd plays its recording again when that
// ends: beside other work it may take more than one round until enough is mapped.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {join} from "node:path";

import {kMeshColours} from "../../../daemon/view/page/scene.mjs";
import {kSilenceMs} from "../../../daemon/view/page/trust.mjs";
import {Browser, watchClock} from "./browser.mjs";

const [perimap, perimapd, configuration, domain, work] = process.argv.slice(2);
const view = spawn(perimap, ["view", "--port", "0", "--domain", domain], {stdio: ["ignore", "pipe", "pipe"]});
let told = "";
view.stderr.on("data", (data) => { told += data; });
const [first] = await once(view.stdout, "data");
const address = String(first).trim();
assert.match(address, /^http:\/\/127\.0\.0\.1:\d+\/$/, "the address is the first line");

const browser = await Browser.open();
let daemon = null;
process.on("exit", () => {
  for (const child of [daemon, view, browser.process]) child?.kill("SIGKILL");
});
const kLongMs = 150000;  // for what takes a machine's time: no promise, the end of the test's patience
let playing = false;
function play() {
  playing = true;
  const started = daemon = spawn(perimapd, ["-c", configuration], {stdio: ["ignore", "ignore", "ignore"]});
  started.on("exit", () => { if (playing && daemon === started) play(); });
}
// So often as a page shows one state for another, and when, on its own clock.
const watchStates = `(() => {
  const trust = document.getElementById("trust");
  window.changes = [];
  new MutationObserver(() => window.changes.push({at: performance.now(), state: trust.dataset.state,
    text: trust.innerText})).observe(trust, {attributes: true, childList: true, characterData: true, subtree: true});
})()`;
const state = `document.getElementById("state").textContent`;
const text = "document.body.innerText";
// Pixels whose colour is the mesh's at some light: as much red, green and blue of each other.
const meshPixels = `(() => {
  const canvas = document.getElementById("scene"), colours = ${JSON.stringify(Object.values(kMeshColours))};
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", {willReadFrequently: true});
  copy.drawImage(canvas, 0, 0);
  const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (colours.some(([r, g, b]) => {
      const light = data[i + 1] / g;
      return light > 0.2 && Math.abs(data[i] - light * r) < 12 && Math.abs(data[i + 2] - light * b) < 12;
    })) ++count;
  }
  return count;
})()`;

const pages = [await browser.page(address)];
const [page] = pages;
assert.ok(await page.until(`${text}.includes("nobody publishes in DDS domain ${domain}")`, 20000), await page.evaluate(text));
assert.equal(await page.evaluate(state), "invalid");

play();
for (let i = 0; i < 3; ++i) pages.push(await browser.page(address));
const converged = `Number(/(\\d+) converged/.exec(${text})?.[1] ?? 0)`;
const usable = `/^(good|degraded)$/.test(${state})`, mapped = `${converged} >= 10 && ${usable}`;
assert.ok(await page.until(mapped, kLongMs), await page.evaluate(text));
for (const other of pages) assert.ok(await other.until(mapped, kLongMs), "not all pages show it");
// What they do not draw any more is left to perimapd.
for (const other of pages.slice(1)) await other.close();
assert.ok(await page.until(`${meshPixels} > 2000`, kLongMs), `${await page.evaluate(meshPixels)} pixels of the mesh`);
assert.ok(await page.until(`document.querySelector('[data-source="camera"]')?.dataset.state === "ok"`, kLongMs), "no camera");
// The surface is drawn anew as it moves.
const drawn = `document.getElementById("scene").toDataURL()`;
await page.evaluate(`window.first = ${drawn}`);
assert.ok(await page.until(`${meshPixels} > 2000 && ${drawn} !== window.first`, kLongMs), "the mesh stands still");
await page.screenshot(join(work, "live.png"));

// Killed while a surface is shown: one that has just ended, or is not shown since the machine is busy, says nothing.
await page.evaluate(watchClock);
await page.evaluate(watchStates);
let killed = 0, gone = 0;
for (let shown = false; !shown;) {
  assert.ok(await page.until(`${mapped} && ${meshPixels} > 2000`, kLongMs), await page.evaluate(text));
  await page.evaluate("window.stoodMs = 0");
  playing = false;
  killed = Date.now();
  daemon.kill("SIGKILL");
  gone = Date.now();
  shown = await page.evaluate(usable);
  if (!shown) play();
}
assert.ok(await page.until(`${state} === "invalid" && ${meshPixels} === 0`, kLongMs), await page.evaluate(text));
const {changes, origin, stoodMs} =
  await page.evaluate("({changes: window.changes, origin: performance.timeOrigin, stoodMs: window.stoodMs})");
const change = changes.find(({at, state: shown}) => shown === "invalid" && origin + at >= killed);
assert.ok(change, `not said: ${JSON.stringify(changes)}`);
assert.ok(await page.until(`${text}.includes("nothing has come from perimapd for")`, kLongMs), await page.evaluate(text));
const afterMs = origin + change.at - gone;
console.log(`nothing was to be trusted any more ${afterMs.toFixed(0)} ms after perimapd was killed; the page could not run for ` +
            `${stoodMs.toFixed(0)} ms at most`);
// Half a second is promised where the page can run. One that is behind says so itself, and is not killed upon.
const kAfterMs = 500;
assert.ok(kSilenceMs < kAfterMs && afterMs <= kAfterMs + 2 * stoodMs, "said late");
assert.equal(await page.evaluate(converged), 0, "a count that nobody tells any more");
assert.ok(await page.until(`document.querySelector('[data-source="camera"]').dataset.state === "unknown"`, kLongMs));
await page.screenshot(join(work, "killed.png"));

// Another run of it is followed anew.
play();
assert.ok(await page.until(mapped, kLongMs), await page.evaluate(text));
assert.ok(!(await page.evaluate(text)).includes("perimapds publish"), "one that was killed counts on");
assert.ok(await page.until(`/ms; \\d{1,3} lost/.test(${text})`, kLongMs), "the counts of two runs are one");
// While view itself stands still the page knows.
view.kill("SIGSTOP");
assert.ok(await page.until(`${state} === "invalid" && ${text}.includes("perimap view does not answer")`, kLongMs), await page.evaluate(text));
view.kill("SIGCONT");
assert.ok(await page.until(usable, kLongMs), await page.evaluate(text));

for (const {complaints, requests} of pages) {
  assert.deepEqual(complaints, [], "the console complains");
  assert.ok(requests.length > 5);
  for (const url of requests) {
    assert.ok(url.startsWith(address) || url.startsWith(address.replace("http:", "ws:")), `a request elsewhere: ${url}`);
  }
}

// A page whose program fails says so, and shows nothing.
const failing = await browser.page(address);
await failing.evaluate(`setTimeout(() => { throw new Error("planted"); }, 0)`);
assert.ok(await failing.until(`${state} === "invalid" && ${text}.includes("this page has failed")`, kLongMs));
assert.equal(await failing.evaluate(meshPixels), 0);

playing = false;
daemon.kill("SIGKILL");
view.kill("SIGINT");
const [code] = await once(view, "exit");
assert.equal(code, 0, told);
assert.ok(await page.until(`${text}.includes("perimap view")`, kLongMs), await page.evaluate(text));
assert.match(told, /nobody publishes in DDS domain/);
assert.match(told, /a perimapd publishes in DDS domain/);
assert.match(told, /nothing has come from perimapd for half a second/);
await browser.close();
console.log("as promised");
process.exit(0);
