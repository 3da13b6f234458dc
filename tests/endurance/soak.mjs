// soak.mjs NOTED WATCH PICTURE REFUSED: judges, prints and draws what soak.sh has noted.
// NOTED: lines of seconds, KiB of memory, descriptors. WATCH: of `perimap watch --json`, an object a second.
import { readFileSync, writeFileSync } from "node:fs";

const [noted, watched, picture, refused] = process.argv.slice(2);
const rows = readFileSync(noted, "utf8").trim().split("\n").map((line) => line.split(" ").map(Number));
const watch = readFileSync(watched, "utf8").trim().split("\n").map((line) => JSON.parse(line));
const intervals = watch.filter((line) => line.kind === "interval" && line.lateness_ms);
const summary = watch.findLast((line) => line.kind === "summary");

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
// Of its second and its last quarter: the first has the map, the buffers and the libraries that grow to their size.
const quarter = Math.floor(rows.length / 4);
const part = (column, from, to) => median(rows.slice(from, to).map((row) => row[column]));
const memory = [part(1, quarter, 2 * quarter), part(1, 3 * quarter, rows.length)];
const descriptors = [part(2, quarter, 2 * quarter), part(2, 3 * quarter, rows.length)];
const growth = memory[1] / memory[0] - 1;
const late = intervals.map((line) => line.lateness_ms.max);
const seconds = rows.at(-1)[0];

console.log(`${seconds} s: ${summary.received} surfaces received, ${summary.missing} missing, ${summary.restarts} restarts`);
console.log(`memory of its own: ${(memory[0] / 1024).toFixed(1)} MiB in the second quarter, ${(memory[1] / 1024).toFixed(1)} MiB in the last (${(100 * growth).toFixed(2)} %)`);
console.log(`descriptors: ${descriptors[0]}, then ${descriptors[1]}, at most ${Math.max(...rows.map((row) => row[2]))}`);
console.log(`lateness, most of each second: median ${median(late).toFixed(2)} ms, most ${Math.max(...late).toFixed(1)} ms; commands refused: ${refused}`);

// Three curves over time, each from nought to its most.
const width = 900, height = 150;
const curve = (points, most) => points.map(([t, v]) => `${((t / seconds) * width).toFixed(1)},${(height - (v / most) * height).toFixed(1)}`).join(" ");
const curves = [
  ["memory of its own, MiB", rows.map((row) => [row[0], row[1] / 1024])],
  ["descriptors", rows.map((row) => [row[0], row[2]])],
  ["lateness, most of each second, ms", late.map((v, i) => [(i / late.length) * seconds, v])],
];
const drawn = curves.map(([name, points], i) => {
  const most = Math.max(...points.map((p) => p[1]), 1e-9) * 1.05;
  return `<g transform="translate(10,${30 + i * (height + 40)})"><text y="-6">${name}, 0 to ${most.toFixed(1)}, over ${seconds} s</text>` +
    `<rect width="${width}" height="${height}" fill="none" stroke="#999"/><polyline fill="none" stroke="#036" points="${curve(points, most)}"/></g>`;
});
writeFileSync(picture, `<svg xmlns="http://www.w3.org/2000/svg" width="${width + 20}" height="${3 * (height + 40) + 20}" font-family="sans-serif" font-size="13">${drawn.join("")}</svg>\n`);

// A reader that keeps sixteen misses none until sixteen have come while it does not run: half a second at 30 a second.
const pauses = late.filter((ms) => ms > 500).length;
const faults = [];
if (!(summary.received > 5 * seconds)) faults.push("too few surfaces were received");
if (summary.missing > 0 && pauses === 0) faults.push(`${summary.missing} surfaces are missing, and none was so late that this explains it`);
if (summary.restarts > 0) faults.push("it was started again");
if (growth > 0.01) faults.push("memory grows by more than 1 %");
if (descriptors[1] > descriptors[0]) faults.push("descriptors grow");
for (const fault of faults) console.log(`FAULT: ${fault}`);
process.exit(faults.length === 0 ? 0 : 1);
