// node page_follows_perimapd.mjs PERIMAP PERIMAPD CONFIGURATION DOMAIN WORK_FOLDER: the page of a running `perimap view`,
// opened in headless Chromium while perimapd starts, publishes and is killed.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {join} from "node:path";

import {kMeshColours} from "../../../daemon/view/page/scene.mjs";
import {Browser, pause} from "./browser.mjs";

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
const start = () => spawn(perimapd, ["-c", configuration], {stdio: ["ignore", "ignore", "ignore"]});
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

daemon = start();
for (let i = 0; i < 3; ++i) pages.push(await browser.page(address));
const converged = `Number(/(\\d+) converged/.exec(${text})?.[1] ?? 0)`;
assert.ok(await page.until(`${converged} >= 10 && /^(good|degraded)$/.test(${state})`, 90000), await page.evaluate(text));
for (const other of pages) {
  assert.ok(await other.until(`/^(good|degraded)$/.test(${state}) && ${converged} >= 10`, 20000), "not all pages show it");
}
assert.ok(await page.until(`${meshPixels} > 2000`, 30000), `${await page.evaluate(meshPixels)} pixels of the mesh`);
assert.ok(await page.until(`document.querySelector('[data-source="camera"]')?.dataset.state === "ok"`, 5000), "no camera");
// The surface is drawn anew as it moves.
const drawn = `document.getElementById("scene").toDataURL()`;
await page.evaluate(`window.first = ${drawn}`);
assert.ok(await page.until(`${meshPixels} > 2000 && ${drawn} !== window.first`, 20000), "the mesh stands still");
await page.screenshot(join(work, "live.png"));

await page.evaluate(watchStates);
const killed = Date.now();
daemon.kill("SIGKILL");
assert.ok(await page.until(`${state} === "invalid" && ${meshPixels} === 0`, 5000), await page.evaluate(text));
const {changes, origin} = await page.evaluate("({changes: window.changes, origin: performance.timeOrigin})");
const change = changes.find(({at, state: shown}) => shown === "invalid" && origin + at >= killed);
assert.ok(change, `not said: ${JSON.stringify(changes)}`);
assert.ok(await page.until(`${text}.includes("nothing has come from perimapd for")`, 5000), await page.evaluate(text));
const afterMs = origin + change.at - killed;
console.log(`nothing was to be trusted any more ${afterMs.toFixed(0)} ms after perimapd was killed`);
assert.ok(afterMs < 2000, "said late, on whatever machine");
assert.equal(await page.evaluate(converged), 0, "a count that nobody tells any more");
assert.ok(await page.until(`document.querySelector('[data-source="camera"]').dataset.state === "unknown"`, 10000));
await page.screenshot(join(work, "killed.png"));

// Another run of it is followed anew.
daemon = start();
assert.ok(await page.until(`${converged} >= 10 && /^(good|degraded)$/.test(${state})`, 90000), await page.evaluate(text));
assert.ok(!(await page.evaluate(text)).includes("perimapds publish"), "one that was killed counts on");
assert.ok(await page.until(`/ms; \\d{1,3} lost/.test(${text})`, 5000), "the counts of two runs are one");
// While view itself stands still the page knows.
view.kill("SIGSTOP");
assert.ok(await page.until(`${state} === "invalid" && ${text}.includes("perimap view does not answer")`, 5000), await page.evaluate(text));
view.kill("SIGCONT");
assert.ok(await page.until(`/^(good|degraded)$/.test(${state})`, 20000), await page.evaluate(text));

for (const {complaints, requests} of pages) {
  assert.deepEqual(complaints, [], "the console complains");
  assert.ok(requests.length > 5);
  for (const url of requests) {
    assert.ok(url.startsWith(address) || url.startsWith(address.replace("http:", "ws:")), `a request elsewhere: ${url}`);
  }
}

// A page whose program fails says so, and shows nothing.
await pages[1].evaluate(`setTimeout(() => { throw new Error("planted"); }, 0)`);
assert.ok(await pages[1].until(`${state} === "invalid" && ${text}.includes("this page has failed")`, 5000));
assert.equal(await pages[1].evaluate(meshPixels), 0);

view.kill("SIGINT");
const [code] = await once(view, "exit");
assert.equal(code, 0, told);
assert.ok(await page.until(`${text}.includes("perimap view")`, 5000), await page.evaluate(text));
assert.match(told, /nobody publishes in DDS domain/);
assert.match(told, /a perimapd publishes in DDS domain/);
assert.match(told, /nothing has come from perimapd for half a second/);
await browser.close();
console.log("as promised");
process.exit(0);
