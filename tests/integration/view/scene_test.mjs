// How the scene is turned: node --test scene_test.mjs
import assert from "node:assert/strict";
import {test} from "node:test";

import {apply, opacityOf, Scene, worldToCamera} from "../../../daemon/view/page/scene.mjs";

const scene = () => new Scene({addEventListener() {}});
const square = [[-10, -10, 100], [10, -10, 100], [10, 10, 100], [-10, 10, 100]];

test("keys turn and come nearer, and 0 goes back", () => {
  const turned = scene(), before = {...turned};
  assert.ok(turned.key("ArrowRight") && turned.yaw > before.yaw);
  assert.ok(turned.key("ArrowUp") && turned.pitch < before.pitch);
  assert.ok(turned.key("+") && turned.scale > before.scale);
  assert.ok(!turned.key("x"));
  turned.key("0");
  assert.deepEqual([turned.yaw, turned.pitch, turned.scale], [before.yaw, before.pitch, before.scale]);
});

test("the view stays while the surface beats, and goes with it to another place", () => {
  const kept = scene();
  kept.adopt(square, null, [0, 1, 2, 0, 2, 3]);
  const frame = kept.frame;
  kept.adopt(square.map(([x, y, z]) => [1.1 * x, y + 1, z]), null, []);
  assert.equal(kept.frame, frame);
  kept.adopt(square.map(([x, y, z]) => [x + 50, y, z]), null, []);
  assert.notEqual(kept.frame, frame);
});

test("nearer is larger, and what is in the middle stays there", () => {
  const view = scene();
  view.adopt(square, null, [0, 1, 2, 0, 2, 3]);
  const look = view.projection(400, 300), [x, y] = look([0, 0, 100]);
  assert.ok(Math.abs(x - 200) < 1e-9 && Math.abs(y - 150) < 1e-9);
  const before = look([5, 5, 100]);
  view.key("+");
  const after = view.projection(400, 300)([5, 5, 100]);
  assert.ok(Math.hypot(after[0] - 200, after[1] - 150) > Math.hypot(before[0] - 200, before[1] - 150));
});

test("a quaternion turns as the wire's do", () => {
  const half = Math.SQRT1_2;  // 90 degrees about z takes x of the camera to y of the world
  const [x, y, z] = apply(worldToCamera([half, 0, 0, half]), [0, 1, 0]);
  assert.ok(Math.abs(x - 1) < 1e-12 && Math.abs(y) < 1e-12 && Math.abs(z) < 1e-12);
});

test("what is less certain is fainter", () => {
  assert.equal(opacityOf([0, 1, 2], [0, 0, 0]), 1);
  assert.equal(opacityOf([0, 1, 2], [1, 1, 1]), 0.5);
  assert.equal(opacityOf([0, 1, 2], [9, 9, 9]), 0.15);
  assert.ok(Math.abs(opacityOf([0, 1, 7], [0, 0]) - 2 / 3) < 1e-12, "a deviation that is missing is a large one");
});
