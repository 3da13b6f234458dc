// Where things are drawn over the camera's picture: node --test picture_test.mjs
import assert from "node:assert/strict";
import {test} from "node:test";

import {Picture} from "../../../daemon/view/page/picture.mjs";

// A canvas that notes what is drawn, in its own coordinates.
function canvas(width, height) {
  const drawn = {circles: [], corners: [], picture: null};
  let offset = [0, 0];
  const context = {
    setTransform() { offset = [0, 0]; },
    translate(x, y) { offset = [offset[0] + x, offset[1] + y]; },
    clearRect() {}, beginPath() {}, closePath() {}, fill() {}, stroke() {},
    save() { drawn.saved = (drawn.saved ?? 0) + 1; }, restore() { --drawn.saved; },
    rect(x, y, w, h) { this.bounds = [x + offset[0], y + offset[1], w, h]; }, clip() { drawn.clipped = this.bounds; },
    drawImage(bitmap, x, y, w, h) { drawn.picture = [x + offset[0], y + offset[1], w, h]; },
    arc(x, y) { drawn.circles.push([x + offset[0], y + offset[1]]); },
    moveTo(x, y) { drawn.corners.push([x + offset[0], y + offset[1]]); },
    lineTo(x, y) { drawn.corners.push([x + offset[0], y + offset[1]]); },
  };
  return {drawn, clientWidth: width, clientHeight: height, getContext: () => context};
}

const overlay = {
  features_px: [0, 0, 319, 239, 100.3, 60.7], feature_ids: [1, 2, 3], feature_states: [2, 1, 2],
  vertices_px: [10, 20, 30, 20, 10, 40], deviations_mm: [0.1, 0.1, 0.1], triangles: [0, 1, 2],
};

async function shown(width, height, state = "good") {
  globalThis.devicePixelRatio = 2;
  globalThis.createImageBitmap = async () => ({width: 320, height: 240});
  const where = canvas(width, height), picture = new Picture(where);
  picture.blob({});
  await picture.overlay({drawn: overlay});
  picture.draw(state);
  return where.drawn;
}

// A pixel's centre in the picture as it was drawn.
const centre = ([x, y, w, h], u, v) => [x + (u + 0.5) * w / 320, y + (v + 0.5) * h / 240];

for (const [width, height] of [[640, 480], [800, 480], [500, 700], [321, 200]]) {
  test(`on ${width}x${height} what is drawn lies on its pixel, to a hundredth of one`, async () => {
    const {picture, circles, corners, clipped, saved} = await shown(width, height);
    assert.ok(picture[0] >= 0 && picture[1] >= 0 && picture[0] + picture[2] <= width + 1e-9);
    assert.ok(Math.abs(picture[2] / picture[3] - 320 / 240) < 1e-9, "the picture is stretched");
    const pixel = picture[2] / 320;
    const expect = ([x, y], u, v) => {
      const [cx, cy] = centre(picture, u, v);
      assert.ok(Math.hypot(x - cx, y - cy) < 0.01 * pixel, `(${u}, ${v}) is drawn at (${x}, ${y})`);
    };
    assert.deepEqual(clipped, picture, "what lies outside the picture is drawn");
    assert.equal(saved, 0, "what comes after it is cut off, too");
    assert.equal(circles.length, 3);
    circles.forEach((at, i) => expect(at, overlay.features_px[2 * i], overlay.features_px[2 * i + 1]));
    assert.equal(corners.length, 3);
    corners.forEach((at, i) => expect(at, overlay.vertices_px[2 * i], overlay.vertices_px[2 * i + 1]));
  });
}

test("over an invalid surface's picture nothing is drawn", async () => {
  const {picture, circles, corners} = await shown(640, 480, "invalid");
  assert.ok(picture);
  assert.deepEqual([circles, corners], [[], []]);
});
