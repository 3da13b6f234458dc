// The last seconds of the heart: the ECG where it is there, beats as they were found and as they are expected, the phase.
import {clear, font, scaled} from "./canvas.mjs";

const kPastMs = 8000, kComingMs = 1600;
const kSameBeatMs = 120;  // a beat's instant is moved a little by what comes after it
const kTwoPi = 2 * Math.PI;

export class Strip {
  constructor(canvas) {
    this.canvas = canvas;
    this.forget();
  }

  forget() {
    this.beats = [];    // ms
    this.phases = [];   // {at, rad, deviation}
    this.samples = [];  // {at, mV}, in order
    this.next = null;   // {at, deviation}
  }

  phase(message) {
    if (message.beats > 0) {
      const last = this.beats.length - 1;
      if (last >= 0 && Math.abs(this.beats[last] - message.last_r_ms) < kSameBeatMs) this.beats[last] = message.last_r_ms;
      else if (last < 0 || message.last_r_ms > this.beats[last]) this.beats.push(message.last_r_ms);
    }
    const known = message.state === "locked" || message.state === "from_image" || message.state === "free_running";
    this.next = known ? {at: message.next_r_ms, deviation: message.next_r_deviation_ms} : null;
    this.state = message.state;
    this.drop(message.time_ms);
  }

  surface(message) {
    const last = this.phases[this.phases.length - 1];
    if (last && message.valid_ms <= last.at) return;
    this.phases.push({at: message.valid_ms, rad: message.phase_rad, deviation: message.phase_deviation_rad,
                      usable: message.state !== "invalid"});
    this.drop(message.valid_ms);
  }

  ecg(message) {
    const last = this.samples.length ? this.samples[this.samples.length - 1].at : -Infinity;
    message.mV.forEach((mV, i) => {
      const at = message.first_ms + i * message.period_ms;
      if (at > last) this.samples.push({at, mV: message.lead_off ? null : mV});
    });
  }

  drop(nowMs) {
    const first = nowMs - kPastMs - 1000;
    const since = (list, at) => {
      const keep = list.findIndex((entry) => at(entry) >= first);
      list.splice(0, keep < 0 ? list.length : keep);
    };
    since(this.beats, (beat) => beat);
    since(this.phases, ({at}) => at);
    since(this.samples, ({at}) => at);
  }

  // nowMs: of the publisher's clock; null: not known.
  draw(nowMs, silent) {
    const cleared = clear(this.canvas);
    if (!cleared || nowMs === null) return;
    const {context, width, height} = cleared;
    this.drop(nowMs);
    const x = (at) => width * (at - nowMs + kPastMs) / (kPastMs + kComingMs);
    const split = this.samples.length ? 0.58 * height : 0.3 * height;
    this.drawGrid(context, x, nowMs, width, height);
    this.drawSamples(context, x, split);
    this.drawBeats(context, x, silent ? null : this.next, nowMs, height);
    this.drawPhase(context, x, split + 6, height - 4);
    context.fillStyle = "#e8eef2";
    context.fillRect(x(nowMs) - 1, 0, 2, height);
  }

  drawGrid(context, x, nowMs, width, height) {
    context.strokeStyle = "#26333d";
    context.lineWidth = 1;
    context.beginPath();
    for (let at = Math.ceil((nowMs - kPastMs) / 1000) * 1000; at < nowMs + kComingMs; at += 1000) {
      context.moveTo(x(at), 0);
      context.lineTo(x(at), height);
    }
    context.stroke();
    context.font = font();
    context.fillStyle = "#a9b8c2";
    context.textAlign = "right";
    context.fillText("now", x(nowMs) - 5, scaled(14));
    context.textAlign = "left";
    context.fillText("to come", x(nowMs) + 5, scaled(14));
  }

  drawSamples(context, x, bottom) {
    const told = this.samples.filter(({mV}) => mV !== null);
    if (!told.length) return;
    const sorted = told.map(({mV}) => mV).sort((a, b) => a - b);
    const low = sorted[Math.floor(0.002 * (sorted.length - 1))], high = sorted[Math.ceil(0.998 * (sorted.length - 1))];
    const y = (mV) => bottom - 4 - (bottom - 26) * (mV - low) / Math.max(high - low, 0.2);
    context.strokeStyle = "#e8eef2";
    context.lineWidth = 1.4;
    context.beginPath();
    let drawing = false;
    for (const {at, mV} of this.samples) {
      if (mV === null) drawing = false;
      else if (drawing) context.lineTo(x(at), y(mV));
      else {
        context.moveTo(x(at), y(mV));
        drawing = true;
      }
    }
    context.stroke();
  }

  // Found: a line with a triangle. Expected: a dashed one amid its deviation.
  drawBeats(context, x, next, nowMs, height) {
    context.fillStyle = context.strokeStyle = "#7cc4ff";
    context.lineWidth = 1.5;
    for (const beat of this.beats) {
      context.beginPath();
      context.moveTo(x(beat) - 6, 0); context.lineTo(x(beat) + 6, 0); context.lineTo(x(beat), 10);
      context.fill();
      context.beginPath();
      context.moveTo(x(beat), 0); context.lineTo(x(beat), height);
      context.stroke();
    }
    if (!next || next.at < nowMs - 500) return;
    context.fillStyle = "rgba(242, 182, 50, 0.25)";
    context.fillRect(x(next.at - next.deviation), 0, Math.max(x(next.at + next.deviation) - x(next.at - next.deviation), 1), height);
    context.strokeStyle = "#f2b632";
    context.setLineDash([6, 5]);
    context.beginPath();
    context.moveTo(x(next.at), 0); context.lineTo(x(next.at), height);
    context.stroke();
    context.setLineDash([]);
  }

  // 0 at an R peak to 2 pi at the next, with its deviation as a band.
  drawPhase(context, x, top, bottom) {
    const y = (rad) => bottom - (bottom - top) * Math.min(Math.max(rad / kTwoPi, 0), 1);
    context.lineWidth = 2;
    for (let i = 1; i < this.phases.length; ++i) {
      const a = this.phases[i - 1], b = this.phases[i];
      if (!b.usable || b.rad === null || a.rad === null || b.at - a.at > 200 || b.rad < a.rad - 0.5) continue;
      const band = Math.min(b.deviation ?? 0, Math.PI);
      context.fillStyle = "rgba(63, 208, 164, 0.22)";
      context.fillRect(x(a.at), y(b.rad + band), x(b.at) - x(a.at), y(b.rad - band) - y(b.rad + band));
      context.strokeStyle = "#3fd0a4";
      context.beginPath();
      context.moveTo(x(a.at), y(a.rad));
      context.lineTo(x(b.at), y(b.rad));
      context.stroke();
    }
  }
}
