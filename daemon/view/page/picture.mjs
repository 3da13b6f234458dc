// The camera's picture with the predicted surface over it, both of one frame.
import {clear, scaled} from "./canvas.mjs";
import {drawFeature} from "./marks.mjs";
import {kMeshColours, opacityOf} from "./scene.mjs";

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.shown = null;  // {bitmap, drawn}
  }

  // The picture comes before what is drawn over it.
  blob(blob) { this.bitmap = createImageBitmap(blob).catch(() => null); }

  async overlay({drawn}) {
    const bitmap = await this.bitmap;
    if (bitmap) this.shown = {bitmap, drawn};
  }

  forget() { this.shown = null; }

  draw(state) {
    const cleared = clear(this.canvas);
    if (!cleared || !this.shown) return;
    const {context, width, height} = cleared, {bitmap, drawn} = this.shown;
    const scale = Math.min(width / bitmap.width, height / bitmap.height);
    context.translate((width - scale * bitmap.width) / 2, (height - scale * bitmap.height) / 2);
    context.drawImage(bitmap, 0, 0, scale * bitmap.width, scale * bitmap.height);
    if (!drawn || state === "invalid") return;
    // What lies outside the picture nobody can compare with it.
    context.save();
    context.beginPath();
    context.rect(0, 0, scale * bitmap.width, scale * bitmap.height);
    context.clip();
    // Pixel centres have whole numbers.
    const at = (flat, i) => [scale * (flat[2 * i] + 0.5), scale * (flat[2 * i + 1] + 0.5)];
    this.drawMesh(context, drawn, at, kMeshColours[state]);
    this.drawFeatures(context, drawn, at);
    context.restore();
  }

  drawMesh(context, {vertices_px, triangles, deviations_mm}, at, [r, g, b]) {
    for (let i = 0; i + 2 < (triangles?.length ?? 0); i += 3) {
      const corners = triangles.slice(i, i + 3), opacity = opacityOf(corners, deviations_mm);
      context.beginPath();
      corners.forEach((corner, k) => {
        const [x, y] = at(vertices_px, corner);
        if (k) context.lineTo(x, y);
        else context.moveTo(x, y);
      });
      context.closePath();
      context.fillStyle = `rgba(${r}, ${g}, ${b}, ${0.16 * opacity})`;
      context.fill();
      context.strokeStyle = `rgba(${r}, ${g}, ${b}, ${0.55 * opacity})`;
      context.lineWidth = 0.8;
      context.stroke();
    }
  }

  drawFeatures(context, {features_px, feature_states}, at) {
    feature_states.forEach((state, i) => {
      const [x, y] = at(features_px, i);
      drawFeature(context, x, y, state, scaled(2.6));
    });
  }
}
