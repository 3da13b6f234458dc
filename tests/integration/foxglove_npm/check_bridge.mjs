// check_bridge.mjs ADDRESS SUBSCRIBED: connects with the official client, makes the file SUBSCRIBED once it has subscribed,
// decodes all that comes by the schemas that come with it, and holds each surface against the heart that scripted_publisher
// makes: z of each feature is 100 + 3 cos(phase) mm.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";

import omgidlParser from "@foxglove/omgidl-parser";
import omgidlSerialization from "@foxglove/omgidl-serialization";
import wsProtocol from "@foxglove/ws-protocol";
import WebSocket from "ws";

const { FoxgloveClient } = wsProtocol;
const [address, subscribed] = process.argv.slice(2);
const readers = new Map(); // by subscription
const scenes = new Map(); // by time, until their worth has come
const seen = { features: 0, meshes: 0, cleared: 0, transforms: 0, states: [], statuses: [] };

function hold(scene, worth) {
  if (worth.state === "invalid") {
    assert.equal(scene.entities.length, 0);
    assert.equal(scene.deletions.length, 1);
    seen.cleared += 1;
    return;
  }
  const [surface, features] = scene.entities;
  assert.equal(features.id, "features");
  assert.equal(features.frame_id, "tracker");
  assert.equal(features.spheres.length, 3); // the fourth is invalid
  features.spheres.forEach(({ pose }, i) => {
    const expected = { x: 0.01 * i, y: -0.005 * i, z: 0.1 + 0.003 * Math.cos(worth.phase_rad) };
    for (const axis of "xyz") assert.ok(Math.abs(pose.position[axis] - expected[axis]) < 1e-9, `feature ${i}`);
  });
  seen.features += 1;
  for (const { points, indices } of surface.triangles) {
    assert.deepEqual(Array.from(indices), [0, 1, 2, 1, 3, 2]);
    points.forEach(({ z }, v) => {
      // Single precision at 100 mm.
      const expected = 0.001 * (90 + v + 1 + 2 * Math.cos(worth.phase_rad));
      assert.ok(Math.abs(z - expected) < 1e-7, `vertex ${v}: ${z} for ${expected}`);
    });
    seen.meshes += 1;
  }
}

function take(topic, time, value) {
  if (value.timestamp) assert.equal(BigInt(value.timestamp.sec) * 1000000000n + BigInt(value.timestamp.nsec), time);
  if (topic === "/surface/scene") scenes.set(time, value);
  if (topic === "/surface/worth") {
    if (seen.states.at(-1) !== value.state) seen.states.push(value.state);
    const scene = scenes.get(time);
    // The last one that is kept comes by itself when it is subscribed to.
    if (scene) hold(scene, value);
    scenes.clear();
  }
  if (topic === "/transforms") {
    assert.equal(value.child_frame_id, "camera");
    assert.ok(Math.abs(value.translation.z - 0.03) < 1e-12);
    seen.transforms += 1;
  }
}

const client = new FoxgloveClient({ ws: new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const ended = new Promise((resolve, reject) => {
  const late = setTimeout(() => reject(new Error(`not done in time: ${JSON.stringify(seen)}`)), 100000);
  client.on("error", reject);
  // run.sh ends the bridge once perimapd is silent; its last word comes before.
  client.on("close", () => {
    clearTimeout(late);
    resolve();
  });
  client.on("serverInfo", ({ name }) => assert.match(name, /^perimap /));
  client.on("advertise", (channels) => {
    assert.deepEqual(channels.map(({ topic }) => topic).sort(), ["/surface/scene", "/surface/worth", "/transforms"]);
    for (const { id, topic, schema, schemaName, schemaEncoding, encoding } of channels) {
      assert.equal(schemaEncoding, "omgidl");
      assert.equal(encoding, "cdr");
      const definitions = omgidlParser.parseIDL(schema);
      readers.set(client.subscribe(id), {
        topic,
        messages: new omgidlSerialization.MessageReader(schemaName, definitions),
      });
    }
    writeFileSync(subscribed, "");
  });
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    try {
      const { topic, messages } = readers.get(subscriptionId);
      take(topic, timestamp, messages.readMessage(data));
    } catch (error) {
      reject(error);
    }
  });
  client.on("status", ({ message }) => {
    seen.statuses.push(message);
  });
});
await ended;
// It listens for a second whether there is one publisher, and three to its meshes.
assert.deepEqual(seen.states, ["invalid", "good", "degraded", "invalid", "good", "invalid"]);
const words = ["may be used", "no pose of the scope", "no heart beat for too long", "may be used", "nothing comes", "has ended"];
let next = 0;
for (const told of seen.statuses) if (next < words.length && told.includes(words[next])) next += 1;
assert.equal(next, words.length, `${words[next]} is missing in ${seen.statuses}`);
assert.ok(seen.features > 20 && seen.meshes > 10 && seen.cleared > 5 && seen.transforms > 20, JSON.stringify(seen));
console.log(`as published: ${seen.features} surfaces, ${seen.meshes} with a mesh, ${seen.transforms} poses of the camera`);
process.exit(0);
