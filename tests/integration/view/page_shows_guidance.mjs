// node page_shows_guidance.mjs PERIMAP DOMAIN WORK_FOLDER: the page of a running `perimap view` in headless Chromium while
// `perimap calibrate camera --live` with WORK_FOLDER/devices.toml says what is missing.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {join} from "node:path";

import {Browser} from "./browser.mjs";

const [perimap, domain, work] = process.argv.slice(2);
const view = spawn(perimap, ["view", "--port", "0", "--domain", domain], {stdio: ["ignore", "pipe", "ignore"]});
const [first] = await once(view.stdout, "data");
const browser = await Browser.open();
let calibrating = null;
process.on("exit", () => {
  for (const child of [calibrating, view, browser.process]) child?.kill("SIGKILL");
});
const page = await browser.page(String(first).trim());
const text = "document.body.innerText", state = `document.getElementById("state").textContent`;
const section = `document.querySelector("section.guidance")`, line = `document.getElementById("guided-line").textContent`;
assert.ok(await page.until(`${text}.includes("nobody publishes in DDS domain ${domain}")`, 20000), await page.evaluate(text));
assert.equal(await page.evaluate(`${section}.hidden`), true, "guidance with nothing calibrated");

calibrating = spawn(perimap, ["calibrate", "camera", "--live", join(work, "devices.toml"), "--square-mm", "8", "--seconds", "26",
                              "--output", join(work, "camera.yaml")], {stdio: ["ignore", "pipe", "pipe"]});
let told = "";
calibrating.stdout.on("data", (data) => { told += data; });
calibrating.stderr.on("data", (data) => { told += data; });
assert.ok(await page.until(`!${section}.hidden`, 10000), await page.evaluate(text));
assert.ok(await page.until(`document.getElementById("why").textContent === "the set-up is being measured: calibrate camera"`, 2000),
          await page.evaluate(text));
assert.equal(await page.evaluate(state), "invalid");
assert.ok(await page.until(`/[0-9]+ views.*show it /.test(${line})`, 30000), await page.evaluate(text) + told);
// What is seen is the camera's picture, and over it the parts that have and have not seen the board.
const colours = `(() => {
  const canvas = document.getElementById("guided-picture");
  if (canvas.width < 2) return {missing: 0, seen: 0, greys: 0};
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", {willReadFrequently: true});
  copy.drawImage(canvas, 0, 0);
  const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
  const of = (r, g, b) => {
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (data[i] === r && data[i + 1] === g && data[i + 2] === b && data[i + 3] === 255) ++count;
    return count;
  };
  const greys = new Set();
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] === 255 && data[i] === data[i + 1] && data[i] === data[i + 2]) greys.add(data[i]);
  return {missing: of(242, 182, 50), seen: of(63, 208, 164), greys: greys.size};
})()`;
assert.ok(await page.until(`(({missing, seen, greys}) => missing > 300 && seen > 300 && greys > 50)(${colours})`, 15000),
          JSON.stringify(await page.evaluate(colours)));
await page.screenshot(join(work, "guidance.png"));
const elapsed = Number(/^(\d+) of 26 s/.exec(await page.evaluate(`document.getElementById("guided-clock").textContent`))?.[1]);
assert.ok(elapsed > 0 && elapsed <= 26, "the time that it takes is not told");

// It is over: recorded, and measured. Or there were too few views, which the terminal says.
assert.ok(await page.until(`/^Recorded/.test(${line})`, 40000), await page.evaluate(text) + told);
if (calibrating.exitCode === null) await once(calibrating, "exit");
assert.ok(await page.until(`${section}.hidden`, 20000), "it is still shown when it is over");
assert.ok(await page.until(`${text}.includes("nobody publishes in DDS domain ${domain}")`, 5000), await page.evaluate(text));
assert.doesNotMatch(told, /perimap view is told nothing/);
assert.deepEqual(page.complaints, [], "the console complains");
await browser.close();
process.exit(0);
