// node page_shows_recording.mjs PERIMAP RECORDING SAMPLES CUT WORK_FOLDER: the page of `perimap view RECORDING --samples
// SAMPLES`, opened in headless Chromium, played and dragged; and that of CUT, a recording that was cut off.
import assert from "node:assert/strict";
import {spawn} from "node:child_process";
import {once} from "node:events";
import {join} from "node:path";

import {Browser, pause} from "./browser.mjs";

const [perimap, recording, samples, cut, work] = process.argv.slice(2);
const children = [];
process.on("exit", () => children.forEach((child) => child.kill("SIGKILL")));
async function serve(...args) {
  const view = spawn(perimap, ["view", "--port", "0", ...args], {stdio: ["ignore", "pipe", "pipe"]});
  children.push(view);
  view.told = "";
  view.stderr.on("data", (data) => { view.told += data; });
  const [first] = await once(view.stdout, "data");
  view.address = String(first).trim();
  return view;
}
const browser = await Browser.open();
children.push(browser.process);

const text = "document.body.innerText", state = `document.getElementById("state").textContent`;
const converged = `Number(/(\\d+) converged/.exec(${text})?.[1] ?? 0)`;
const clock = `document.getElementById("clock").textContent`;
const drag = (share) => `(() => {
  const time = document.getElementById("time");
  time.value = ${share} * time.max;
  time.dispatchEvent(new Event("input"));
})()`;
// The picture is grey: what has a colour is drawn over it.
const coloured = `(() => {
  const canvas = document.getElementById("picture");
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", {willReadFrequently: true});
  copy.drawImage(canvas, 0, 0);
  const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
  let grey = 0, coloured = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (!data[i + 3]) continue;
    if (Math.max(Math.abs(data[i] - data[i + 1]), Math.abs(data[i + 1] - data[i + 2])) > 12) ++coloured;
    else ++grey;
  }
  return {grey, coloured};
})()`;

const view = await serve(recording, "--samples", samples);
const page = await browser.page(view.address);
assert.ok(await page.until(`/0:00.0 \\/ 0:\\d\\d/.test(${clock})`, 20000), await page.evaluate(text));
assert.equal(await page.evaluate(state), "invalid", "nothing is mapped at the beginning");
await page.evaluate(drag(0.8));
assert.ok(await page.until(`/^(good|degraded)$/.test(${state}) && ${converged} >= 10`, 20000), await page.evaluate(text));
assert.ok(await page.until(`(({grey, coloured}) => grey > 5000 && coloured > 1000)(${coloured})`, 10000),
          JSON.stringify(await page.evaluate(coloured)));
await page.screenshot(join(work, "recording.png"));
const before = await page.evaluate(clock);
await page.evaluate(`document.body.dispatchEvent(new KeyboardEvent("keydown", {key: " ", bubbles: true}))`);
assert.ok(await page.until(`${clock} !== ${JSON.stringify(before)}`, 10000), "it does not play");
await pause(1000);
assert.match(await page.evaluate(state), /^(good|degraded)$/, "played, it is as good");
// Back to where nothing is mapped yet: nothing of what was shown stays.
await page.evaluate(`document.getElementById("play").click()`);
await page.evaluate(drag(0.02));
assert.ok(await page.until(`${state} === "invalid" && ${coloured}.coloured === 0`, 10000), await page.evaluate(text));
assert.deepEqual(page.complaints, [], "the console complains");
for (const url of page.requests) {
  assert.ok(url.startsWith(view.address) || url.startsWith(view.address.replace("http:", "ws:")) || url.startsWith("blob:"), url);
}
view.kill("SIGTERM");
assert.deepEqual(await once(view, "exit"), [0, null], view.told);

const damaged = await serve(cut);
const other = await browser.page(damaged.address);
assert.ok(await other.until(`document.getElementById("warning").textContent.includes("what is whole is shown")`, 20000),
          await other.evaluate(text));
assert.match(damaged.told, /byte \d+: /);
await other.evaluate(drag(1));
assert.ok(await other.until(`/^(good|degraded)$/.test(${state})`, 20000), await other.evaluate(text));
assert.deepEqual(other.complaints, []);
await browser.close();
console.log("as promised");
process.exit(0);
