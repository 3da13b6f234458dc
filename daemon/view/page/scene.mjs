// The surface in three dimensions, to turn: features, mesh and scope. Canvas 2D: a few hundred triangles, from the back to
// the front (docs/decisions/0089).
import {clear, font, scaled} from "./canvas.mjs";
import {drawFeature} from "./marks.mjs";
import {kToolColour, kTouchColour, shortName} from "./tools.mjs";
import {worse} from "./trust.mjs";

export const kMeshColours = {good: [63, 208, 164], degraded: [242, 182, 50]};
const kFaintMm = 2;  // a mesh of such a deviation is drawn faintest
const kFocal = 3.5;  // of the viewer, in halves of the smaller side
const kKeyTurn = 0.12, kKeyZoom = 1.15;

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

// Rows of the rotation that takes world to camera, of a quaternion w, x, y, z that takes camera to world.
export function worldToCamera([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}
export const apply = (rows, v) => rows.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);

// Rows of a rotation that looks at the triangles from where the scope was, whose normals point there, with the scope's own
// right-hand side on the right where that is known.
function facing(points, triangles, camera) {
  const rows = camera ? worldToCamera(camera.rotation_wxyz) : [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  let n = [0, 0, 0];
  for (let i = 0; i + 2 < triangles.length; i += 3) {
    const [a, b, c] = triangles.slice(i, i + 3).map((corner) => points[corner]);
    const across = cross(sub(b, a), sub(c, a));
    n = n.map((value, axis) => value - across[axis]);
  }
  const z = n.map((value) => value / norm(n)), y = cross(z, rows[0]);
  if (!(norm(n) > 0) || norm(y) < 0.1) return rows;
  const down = y.map((value) => value / norm(y));
  return [cross(down, z), down, z];
}

// Of a triangle, by its corners' deviations: none is seen through, 2 mm are the faintest.
export function opacityOf(corners, deviationsMm) {
  const mean = corners.reduce((sum, corner) => sum + (deviationsMm[corner] ?? kFaintMm), 0) / corners.length;
  return clamp(1 - mean / kFaintMm, 0.15, 1);
}

export function pointsOf(flat) {
  const points = [];
  for (let i = 0; i + 2 < flat.length; i += 3) points.push([flat[i], flat[i + 1], flat[i + 2]]);
  return points;
}

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.reset();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.dragged = [event.clientX, event.clientY];
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.dragged) return;
      this.turn((event.clientX - this.dragged[0]) * 0.008, (event.clientY - this.dragged[1]) * 0.008);
      this.dragged = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { this.dragged = null; });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1 / kKeyZoom : kKeyZoom);
    }, {passive: false});
    canvas.addEventListener("keydown", (event) => {
      if (this.key(event.key)) event.preventDefault();
    });
  }

  reset() {
    this.yaw = 0.4;
    this.pitch = -0.5;
    this.scale = 1;
    this.frame = null;  // where the first surface was, and how the scope looked at it
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -1.55, 1.55);
  }
  zoom(factor) { this.scale = clamp(this.scale * factor, 0.2, 12); }
  key(name) {
    const keys = {
      ArrowLeft: () => this.turn(-kKeyTurn, 0), ArrowRight: () => this.turn(kKeyTurn, 0),
      ArrowUp: () => this.turn(0, -kKeyTurn), ArrowDown: () => this.turn(0, kKeyTurn),
      "+": () => this.zoom(kKeyZoom), "=": () => this.zoom(kKeyZoom), "-": () => this.zoom(1 / kKeyZoom), 0: () => this.reset(),
    };
    if (!(name in keys)) return false;
    keys[name]();
    return true;
  }

  // The view stays where it is while the surface beats; few that are far off do not move it.
  adopt(points, camera, triangles) {
    if (points.length < 3) return;
    const share = (axis, q) => points.map((p) => p[axis]).sort((a, b) => a - b)[Math.round(q * (points.length - 1))];
    const low = [0, 1, 2].map((axis) => share(axis, 0.05)), high = [0, 1, 2].map((axis) => share(axis, 0.95));
    const centre = low.map((value, i) => (value + high[i]) / 2), size = Math.max(norm(sub(high, low)), 5);
    const kept = this.frame;
    if (kept && norm(sub(centre, kept.centre)) < 0.2 * kept.size && size < 1.3 * kept.size && size > 0.6 * kept.size) return;
    const rows = kept?.rows ?? facing(points, triangles, camera);
    this.frame = {centre, size, rows};
  }

  // surface: as the server tells it, or null: nothing is drawn. state: as the page trusts it.
  draw(surface, state) {
    const cleared = clear(this.canvas);
    if (!cleared) return;
    const {context, width, height} = cleared;
    if (!surface?.features || state === "invalid") return this.say(context, width, height, "no position may be used");
    const features = pointsOf(surface.features.positions_mm);
    const vertices = pointsOf(surface.mesh?.positions_mm ?? []);
    this.adopt(vertices.length ? vertices : features, surface.camera, surface.mesh?.triangles ?? []);
    if (!this.frame) return this.say(context, width, height, "too few features to draw yet");
    const look = this.projection(width, height);
    this.drawMesh(context, surface.mesh, vertices.map(look), worse(state, surface.mesh?.state ?? "invalid"));
    this.drawFeatures(context, surface.features, features.map(look));
    if (surface.camera) this.drawScope(context, width, height, surface.camera, look);
    this.drawTools(context, width, height, surface.tools ?? [], look);
    this.drawScaleBar(context, height, look);
  }

  say(context, width, height, words) {
    context.font = font(22);
    context.fillStyle = "#a9b8c2";
    context.textAlign = "center";
    context.fillText(words, width / 2, height / 2);
  }

  // World to [x, y, depth in mm, pixels a mm].
  projection(width, height) {
    const {centre, size, rows} = this.frame, half = Math.min(0.8 * width, height) / 2;
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    const distance = kFocal * size / 2.3 / this.scale + 0.2 * size;
    return (p) => {
      const [x, y, z] = apply(rows, sub(p, centre));
      const x1 = cy * x + sy * z, z1 = -sy * x + cy * z;
      const y2 = cp * y - sp * z1, depth = Math.max(sp * y + cp * z1 + distance, 0.02 * size);
      const scale = kFocal * half / depth;
      return [width / 2 + scale * x1, height / 2 + scale * y2, depth, scale];
    };
  }

  drawMesh(context, mesh, at, state) {
    if (!at.length || state === "invalid") return;
    const [r, g, b] = kMeshColours[state];
    const triangles = [];
    for (let i = 0; i + 2 < mesh.triangles.length; i += 3) {
      const corners = mesh.triangles.slice(i, i + 3);
      const [p, q, s] = corners.map((corner) => at[corner]);
      // Depth counts as much as width on the screen, so that the slope is that of the surface.
      const lift = (a) => [a[0], a[1], a[2] * p[3]];
      const n = cross(sub(lift(q), lift(p)), sub(lift(s), lift(p)));
      const straight = Math.abs(n[2]) / (norm(n) || 1);
      triangles.push({corners: [p, q, s], depth: p[2] + q[2] + s[2], light: 0.35 + 0.65 * straight,
                      opacity: opacityOf(corners, mesh.deviations_mm)});
    }
    triangles.sort((a, b) => b.depth - a.depth);
    context.lineWidth = 0.8;
    context.lineJoin = "round";
    for (const {corners: [p, q, s], light, opacity} of triangles) {
      context.beginPath();
      context.moveTo(p[0], p[1]);
      context.lineTo(q[0], q[1]);
      context.lineTo(s[0], s[1]);
      context.closePath();
      const colour = `rgba(${Math.round(r * light)}, ${Math.round(g * light)}, ${Math.round(b * light)}, `;
      context.fillStyle = `${colour}${opacity})`;
      context.fill();
      context.strokeStyle = `rgba(10, 20, 24, ${0.5 * opacity})`;
      context.stroke();
    }
  }

  drawFeatures(context, {states}, at) {
    at.forEach(([x, y], i) => {
      drawFeature(context, x, y, states[i], scaled(2.2));
    });
  }

  // Its tip, and how it looks at the surface.
  drawScope(context, width, height, camera, look) {
    const rows = worldToCamera(camera.rotation_wxyz), length = 0.12 * this.frame.size;
    const world = (p) => p && camera.translation_mm.map((t, i) => t + rows[0][i] * p[0] + rows[1][i] * p[1] + rows[2][i] * p[2]);
    const slopes = camera.focal_px?.map((focal, i) => camera.principal_point_px[i] / focal) ?? [0.6, 0.45];
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => [x * length * slopes[0], y * length * slopes[1], length]);
    const tip = look(world([0, 0, 0])), base = corners.map((corner) => look(world(corner)));
    context.strokeStyle = "#7cc4ff";
    context.lineWidth = 1.5;
    context.beginPath();
    base.forEach(([x, y], i) => {
      context.moveTo(tip[0], tip[1]);
      context.lineTo(x, y);
      context.lineTo(base[(i + 1) % 4][0], base[(i + 1) % 4][1]);
    });
    context.stroke();
    context.fillStyle = "#7cc4ff";
    this.label(context, width, height, tip[0], tip[1], "scope");
  }

  // Each tip, and the way from it to the surface.
  drawTools(context, width, height, tools, look) {
    for (const tool of tools) {
      if (!tool.tip_mm) continue;
      const [x, y] = look(tool.tip_mm), size = scaled(6);
      context.strokeStyle = context.fillStyle = tool.touches ? kTouchColour : kToolColour;
      context.lineWidth = 2;
      if (tool.nearest_mm) {
        const [nx, ny] = look(tool.nearest_mm);
        context.beginPath();
        context.moveTo(x, y);
        context.lineTo(nx, ny);
        context.stroke();
      }
      context.beginPath();
      context.moveTo(x - size, y); context.lineTo(x, y - size); context.lineTo(x + size, y); context.lineTo(x, y + size);
      context.closePath();
      if (tool.state === "invalid") context.stroke();  // hollow: where it is, and not how far
      else context.fill();
      this.label(context, width, height, x, y, shortName(tool.tool));
    }
  }

  // Beside a place, inside of the canvas; not of what is far outside.
  label(context, width, height, x, y, words) {
    context.font = font();
    context.textAlign = "left";
    const length = context.measureText(words).width, near = scaled(40);
    if (x < -near || x > width + near || y < -near || y > height + near) return;
    context.fillText(words, clamp(x + 10, 4, Math.max(4, width - length - 4)), clamp(y - 6, scaled(16), height - 6));
  }

  drawScaleBar(context, height, look) {
    const scale = look(this.frame.centre)[3];
    const length = [1, 2, 5, 10, 20, 50, 100].find((mm) => mm * scale > scaled(60)) ?? 200;
    context.fillStyle = "#e8eef2";
    context.fillRect(10, height - 12, length * scale, 3);
    context.font = font();
    context.textAlign = "left";
    context.fillText(`${length} mm`, 10, height - 18);
  }
}
