// How long after its deadline each surface was received, over the last minute.
import {clear, font, scaled} from "./canvas.mjs";

const kKeptMs = 60000;
const kBinMs = 0.5, kBins = 40;  // the last bin has all that are later

export class Delays {
  constructor(canvas) {
    this.canvas = canvas;
    this.forget();
  }

  forget() {
    this.kept = [];  // {at, late}
    this.lost = 0;
  }

  add(nowMs, lateMs, lost) {
    for (const late of lateMs) this.kept.push({at: nowMs, late});
    this.lost += lost;
    this.drop(nowMs);
  }

  drop(nowMs) {
    const first = this.kept.findIndex(({at}) => at > nowMs - kKeptMs);
    this.kept.splice(0, first < 0 ? this.kept.length : first);
  }

  // Nearest rank.
  quantiles() {
    const sorted = this.kept.map(({late}) => late).sort((a, b) => a - b);
    const at = (share) => sorted[Math.max(Math.ceil(share * sorted.length) - 1, 0)];
    return sorted.length ? {p50: at(0.5), p99: at(0.99), most: sorted[sorted.length - 1]} : null;
  }

  words() {
    const q = this.quantiles();
    if (!q) return "nothing received in the last minute";
    return `half ${q.p50.toFixed(1)}, 99 % ${q.p99.toFixed(1)}, most ${q.most.toFixed(1)} ms; ${this.lost} lost`;
  }

  draw(nowMs) {
    this.drop(nowMs);
    const cleared = clear(this.canvas);
    if (!cleared || !this.kept.length) return;
    const {context, width, height} = cleared;
    const counts = new Array(kBins).fill(0);
    for (const {late} of this.kept) ++counts[Math.min(Math.max(Math.floor(late / kBinMs), 0), kBins - 1)];
    const most = Math.max(...counts), bottom = height - scaled(20), step = width / kBins;
    // Logarithmic, since one late surface in a thousand is what is looked for.
    const tall = (count) => count ? (bottom - 4) * Math.log(1 + count) / Math.log(1 + most) : 0;
    context.fillStyle = "#7cc4ff";
    counts.forEach((count, i) => context.fillRect(i * step + 1, bottom - tall(count), step - 2, tall(count)));
    context.fillStyle = "#a9b8c2";
    context.font = font();
    context.fillRect(0, bottom, width, 1);
    for (let ms = 0; ms < kBins * kBinMs; ms += 5) {
      context.textAlign = ms ? "center" : "left";
      context.fillText(ms ? String(ms) : "0 ms", ms / kBinMs * step, height - 4);
    }
    context.textAlign = "right";
    context.fillText("or later", width, height - 4);
  }
}
