// check_view_export.mjs RECORDING EXPECTED.json: decodes every message of an exported file with the official packages, from
// nothing but the file itself, and compares it with what this project's own reader decodes.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import omgidlParser from "@foxglove/omgidl-parser";
import omgidlSerialization from "@foxglove/omgidl-serialization";
import zstd from "@foxglove/wasm-zstd";
import { McapStreamReader } from "@mcap/core";

const [recordingPath, expectedPath] = process.argv.slice(2);
const expected = JSON.parse(readFileSync(expectedPath, "utf8"));
await zstd.isLoaded;

const xyz = ({ x, y, z }) => [x, y, z];
const xy = ({ x, y }) => [x, y];
const rgba = ({ r, g, b, a }) => [r, g, b, a];

const views = {
  "foxglove::SceneUpdate": (scene) => ({
    deletions: scene.deletions.map(({ type, id }) => ({ type, id })),
    entities: scene.entities.map((entity) => ({
      id: entity.id,
      frame: entity.frame_id,
      lifetime: [entity.lifetime.sec, entity.lifetime.nsec],
      locked: entity.frame_locked,
      triangles: entity.triangles.map(({ points, colors, indices }) => ({
        points: points.map(xyz),
        colors: colors.map(rgba),
        indices: Array.from(indices),
      })),
      spheres: entity.spheres.map(({ pose, size, color }) => ({
        position: xyz(pose.position),
        size: xyz(size),
        color: rgba(color),
      })),
      lines: entity.lines.map(({ type, thickness, points }) => ({ type, thickness, points: points.map(xyz) })),
    })),
  }),
  "foxglove::ImageAnnotations": (over) => ({
    circles: over.circles.map(({ position, diameter, outline_color }) => ({
      position: xy(position),
      diameter,
      color: rgba(outline_color),
    })),
    points: over.points.map(({ type, points, thickness }) => ({ type, points: points.map(xy), thickness })),
    texts: over.texts.map(({ text }) => ({ text })),
  }),
  "foxglove::CameraCalibration": (c) => ({
    frame: c.frame_id,
    size: [c.width, c.height],
    model: c.distortion_model,
    D: Array.from(c.D),
    K: Array.from(c.K),
    R: Array.from(c.R),
    P: Array.from(c.P),
  }),
  "foxglove::FrameTransform": (t) => ({
    parent: t.parent_frame_id,
    child: t.child_frame_id,
    translation: xyz(t.translation),
    rotation: [t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w],
  }),
  "foxglove::RawImage": (image) => ({
    frame: image.frame_id,
    size: [image.width, image.height],
    encoding: image.encoding,
    data: Array.from(image.data),
  }),
  "perimap_view::EcgValue": ({ mV }) => ({ mV }),
  "perimap_view::SurfaceWorth": ({ state, reason, features, converged, phase_rad }) => ({
    state,
    reason,
    features,
    converged,
    phase_rad,
  }),
};

const reader = new McapStreamReader({
  decompressHandlers: { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) },
  validateCrcs: true,
});
reader.append(readFileSync(recordingPath));
const schemas = new Map();
const channels = new Map();
const seen = new Set();
let count = 0;
for (let record; (record = reader.nextRecord()) !== undefined; ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") {
    const schema = schemas.get(record.schemaId);
    const definitions = omgidlParser.parseIDL(new TextDecoder().decode(schema.data));
    const messages = new omgidlSerialization.MessageReader(schema.name, definitions);
    channels.set(record.id, { topic: record.topic, view: views[schema.name], messages });
  }
  if (record.type === "Message") {
    const { topic, view, messages } = channels.get(record.channelId);
    const value = messages.readMessage(record.data);
    const stamp = value.timestamp;
    // A viewer goes by either.
    if (stamp) assert.equal(BigInt(stamp.sec) * 1000000000n + BigInt(stamp.nsec), record.logTime);
    const got = { topic, time: record.logTime.toString(), value: view(value) };
    assert.deepEqual(got, expected[count], `message ${count}`);
    seen.add(topic);
    count += 1;
  }
}
assert.ok(reader.done());
assert.equal(count, expected.length);
assert.equal(seen.size, Object.keys(views).length);
console.log(`${count} messages of ${seen.size} channels are right`);
