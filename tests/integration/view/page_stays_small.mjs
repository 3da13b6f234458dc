// node page_stays_small.mjs PERIMAP PERIMAPD CONFIGURATION DOMAIN MINUTES: four pages of a running `perimap view` in headless
// Chromium, while perimapd plays its recording again and again. What the pages, and `perimap view`, keep in memory does not
// grow once it is there.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {readFileSync} from "node:fs";

import {Browser, pause} from "./browser.mjs";

const [perimap, perimapd, configuration, domain, minutes] = process.argv.slice(2);
const kPages = 4, kReadings = 20;
const lengthMs = 60e3 * Number(minutes);
const view = spawn(perimap, ["view", "--port", "0", "--domain", domain], {stdio: ["ignore", "pipe", "ignore"]});
const [first] = await once(view.stdout, "data");
const browser = await Browser.open();
let daemon = null, runs = 0, over = false;
process.on("exit", () => {
  for (const child of [daemon, view, browser.process]) child?.kill("SIGKILL");
});
function play() {
  if (over) return;
  ++runs;
  daemon = spawn(perimapd, ["-c", configuration], {stdio: ["ignore", "ignore", "ignore"]});
  daemon.on("exit", play);
}
play();

const pages = [];
for (let i = 0; i < kPages; ++i) pages.push(await browser.page(String(first).trim()));
const state = `document.getElementById("state").textContent`;
assert.ok(await pages[0].until(`/^(good|degraded)$/.test(${state})`, 120000), "no surface is shown");

// What is reachable: garbage is collected first.
async function reading() {
  let heap = 0, nodes = 0, listeners = 0;
  for (const page of pages) {
    await page.ask("HeapProfiler.collectGarbage");
    heap += (await page.ask("Runtime.getHeapUsage")).usedSize;
    const counters = await page.ask("Memory.getDOMCounters");
    nodes += counters.nodes;
    listeners += counters.jsEventListeners;
  }
  const resident = Number(/VmRSS:\s+(\d+) kB/.exec(readFileSync(`/proc/${view.pid}/status`, "utf8"))[1]);
  return {heap_kB: Math.round(heap / 1024), nodes, listeners, view_kB: resident};
}

// What is shown of the last minute has to fill up first.
await pause(Math.min(75e3, lengthMs / 4));
const readings = [];
const begun = Date.now();
for (let i = 0; i < kReadings; ++i) {
  await pause(begun + i * lengthMs / (kReadings - 1) - Date.now());
  readings.push({minute: ((Date.now() - begun) / 60e3).toFixed(1), ...(await reading())});
  console.log(JSON.stringify(readings.at(-1)));
}
over = true;
// What is shown grows within each run of perimapd and begins anew with the next, so that the largest of the first half is
// held against the largest of the second. A leak of one surface's positions in a hundred would be more than this.
const most = (some, of) => Math.max(...some.map((one) => one[of]));
const early = readings.slice(0, kReadings / 2), late = readings.slice(kReadings / 2);
for (const [of, share, allowed] of [["heap_kB", 1.1, 1024], ["nodes", 1.05, 20], ["listeners", 1, 0], ["view_kB", 1.05, 2048]]) {
  const before = most(early, of), after = most(late, of);
  assert.ok(after <= share * before + allowed, `${of} grew from ${before} to ${after}`);
}
for (const page of pages) assert.deepEqual(page.complaints, [], "the console complains");
console.log(`as promised: ${minutes} minutes, ${runs} runs of perimapd, ${kPages} pages`);
await browser.close();
process.exit(0);
