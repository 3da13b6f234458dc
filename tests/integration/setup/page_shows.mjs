// node page_shows.mjs PAGE.dom RESULT.json: whether an opened page of calibrate, register or verify draws its pictures and
// has the figures of its result, each rounded as the page rounds it.
import assert from "node:assert/strict";
import {readFileSync} from "node:fs";

const [dom, json] = process.argv.slice(2).map((file) => readFileSync(file, "utf8"));
const found = dom.match(/<script type="application\/json" id="shown">([^]*?)<\/script>/);
assert.ok(found, "the page's own script did not run");
const unescaped = found[1].replaceAll("&lt;", "<").replaceAll("&gt;", ">").replaceAll("&quot;", '"').replaceAll("&amp;", "&");
const shown = JSON.parse(unescaped);
assert.ok(shown.title.length > 5, "no title");
assert.ok(shown.loaded.every((is) => is), "a picture did not load");
assert.ok(shown.drawn.length + shown.loaded.length > 0, "no picture at all");
for (const {width, height, marks} of shown.drawn) {
  assert.ok(width > 100 && height > 100 && marks > 3, `a picture of ${width}x${height} with ${marks} marks`);
}
assert.doesNotMatch(shown.text, /\bnan\b|\binf\b|undefined/i, "a figure that is none");

// The words of a page name what the JSON has under a key of its own; of a list every number must be there.
const figures = ["focal_px", "principal_point_px", "rms_px", "translation_mm", "residual_median_mm", "held_aside_rms_mm",
                 "time_offset_ms", "tip_mm", "position_deviation_mm", "rotation_deviation_deg", "fre_mm", "scatter_mm",
                 "board_error_mm", "touch_error_mm", "rotation_deg"];
const numbers = [...shown.text.matchAll(/-?\d+(?:\.(\d+))?/g)].map(([text, decimals]) => ({
  value: Number(text), half: 0.500001 * 10 ** -(decimals ?? "").length,
}));
const result = JSON.parse(json);
let compared = 0;
for (const key of figures) {
  if (!(key in result) || result[key] === null) continue;
  for (const value of [result[key]].flat()) {
    assert.ok(numbers.some(({value: told, half}) => Math.abs(told - value) <= half && half < 0.06),
              `${key}: ${value} is not on the page`);
    ++compared;
  }
}
assert.ok(compared > 0, `nothing to compare in ${Object.keys(result)}`);
console.log(`${shown.title}: ${shown.drawn.length} pictures, ${compared} figures`);
