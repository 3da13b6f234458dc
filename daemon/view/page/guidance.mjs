// What is told while a calibration is recorded: what is missing, for how long it goes on, and in which parts of the picture
// the board was.
import {clear, font, scaled} from "./canvas.mjs";

// It is told five times a second; what is older is over.
export const kOverMs = 2000;
// So long it stays after it was recorded, while it is measured.
export const kRecordedMs = 15000;

// The parts that have not been seen enough yet: as rectangles of a picture of width x height, with what was seen of each.
export function partsOf({columns, rows, seen_percent}, width, height) {
  const parts = [];
  for (let i = 0; columns > 0 && i < columns * rows; ++i) {
    const seen = seen_percent[i];
    parts.push({x: (i % columns) * width / columns, y: Math.floor(i / columns) * height / rows, width: width / columns,
                height: height / rows, seen, enough: seen >= 100});
  }
  return parts;
}

export class Guidance {
  // elements: {section, what, line, clock, bar, canvas}
  constructor(elements) {
    this.elements = elements;
    this.forget();
  }

  forget() {
    this.told = null;
    this.bitmap = null;
  }

  take(message, now) {
    if (this.told?.what !== message.what) this.bitmap = null;
    this.told = message;
    this.cameAt = now;
  }

  // The picture comes after what is told of it.
  async picture(blob) {
    const bitmap = await createImageBitmap(blob).catch(() => null);
    if (bitmap && this.told) this.bitmap = bitmap;
  }

  // What is being calibrated; empty: nothing, or it is over.
  what(now) {
    if (!this.told) return "";
    const {what, stage} = this.told, lasts = stage === "recorded" ? kRecordedMs : kOverMs;
    return now - this.cameAt <= lasts ? what : "";
  }

  draw(now) {
    const {section, what, line, clock, bar, canvas} = this.elements, shown = this.what(now);
    if (section.hidden !== !shown) section.hidden = !shown;
    if (!shown) return this.forget();
    const {told} = this, recorded = told.stage === "recorded";
    const words = recorded ? "Recorded. It is being measured now: the terminal tells the result." : told.line;
    if (what.textContent !== shown) what.textContent = shown;
    if (line.textContent !== words) line.textContent = words;
    clock.textContent = `${Math.round(told.elapsed_s)} of ${Math.round(told.longest_s)} s at most`;
    bar.max = told.longest_s;
    bar.value = told.elapsed_s;
    this.drawPicture(canvas, recorded);
  }

  drawPicture(canvas, recorded) {
    const cleared = clear(canvas);
    if (!cleared || recorded) return;
    const {context} = cleared, size = this.bitmap ?? {width: 16, height: 9};
    const scale = Math.min(cleared.width / size.width, cleared.height / size.height);
    const width = scale * size.width, height = scale * size.height;
    context.translate((cleared.width - width) / 2, (cleared.height - height) / 2);
    if (this.bitmap) context.drawImage(this.bitmap, 0, 0, width, height);
    for (const part of partsOf(this.told, width, height)) this.drawPart(context, part);
  }

  // Told by the mark and the words, and then by colour.
  drawPart(context, {x, y, width, height, seen, enough}) {
    context.lineWidth = enough ? 1.5 : 4;
    context.strokeStyle = enough ? "#3fd0a4" : "#f2b632";
    context.setLineDash(enough ? [] : [10, 6]);
    context.strokeRect(x + 3, y + 3, width - 6, height - 6);
    context.setLineDash([]);
    const words = enough ? "\u2713" : `show it here: ${seen} %`;
    context.font = font();
    const room = context.measureText(words).width + 12;
    context.fillStyle = "rgba(0, 0, 0, 0.75)";
    context.fillRect(x + 8, y + 8, room, scaled(24));
    context.fillStyle = enough ? "#3fd0a4" : "#ffd97a";
    context.fillText(words, x + 14, y + 8 + scaled(17));
  }
}
