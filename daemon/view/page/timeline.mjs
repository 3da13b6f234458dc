// The instant of a recording that is shown: played, dragged, stepped.
import {clear} from "./canvas.mjs";

const kColours = {good: "#3fd0a4", degraded: "#f2b632", invalid: "#ffffff"};
const kHeights = {good: 0.35, degraded: 0.65, invalid: 1};  // so that states differ without colour
const kStepS = 1 / 30;

export function clockText(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(1).padStart(4, "0")}`;
}

export class Timeline {
  // ask({at_s, from_here}): the server answers with messages, then with one of kind "at".
  constructor({footer, button, slider, clock, states}, ask) {
    Object.assign(this, {footer, button, slider, clock, states, ask, at: 0, playing: false, waiting: false, jumped: true});
    slider.addEventListener("input", () => this.jump(Number(slider.value)));
    button.addEventListener("click", () => this.toggle());
  }

  begin({length_s, states}) {
    this.footer.hidden = false;
    this.length = length_s;
    this.spans = states;
    this.slider.max = length_s;
    this.waiting = false;
    this.jump(Math.min(this.at, length_s));
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.at >= this.length) this.jump(0);
    this.button.textContent = this.playing ? "Pause" : "Play";
    this.last = performance.now();
  }

  jump(at) {
    this.at = Math.min(Math.max(at, 0), this.length ?? 0);
    this.jumped = this.wanted = true;
  }

  key(name) {
    const keys = {" ": () => this.toggle(), ".": () => this.jump(this.at + kStepS), ",": () => this.jump(this.at - kStepS),
                  Home: () => this.jump(0), End: () => this.jump(this.length)};
    if (this.footer.hidden || !(name in keys)) return false;
    keys[name]();
    return true;
  }

  // Each time the page draws: one question at a time.
  advance() {
    if (this.footer.hidden) return;
    const now = performance.now();
    if (this.playing && !this.waiting) {
      this.at = Math.min(this.at + Math.min(now - this.last, 250) / 1000, this.length);
      this.last = now;
      this.wanted = true;
      if (this.at >= this.length) this.toggle();
    }
    if (this.wanted && !this.waiting) {
      this.ask({at_s: this.at, from_here: !this.jumped});
      this.wanted = this.jumped = false;
      this.waiting = true;
    }
    this.slider.value = this.at;
    this.clock.textContent = `${clockText(this.at)} / ${clockText(this.length)}`;
  }

  answered() { this.waiting = false; }

  draw() {
    const cleared = this.footer.hidden ? null : clear(this.states);
    if (!cleared) return;
    const {context, width, height} = cleared;
    for (const [begin, end, state] of this.spans) {
      context.fillStyle = kColours[state] ?? kColours.invalid;
      const tall = height * (kHeights[state] ?? 1);
      context.fillRect(width * begin / this.length, height - tall, Math.max(width * (end - begin) / this.length, 1), tall);
    }
  }
}
