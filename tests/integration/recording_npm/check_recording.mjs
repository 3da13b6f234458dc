// check_recording.mjs RECORDING EXPECTED.json: decodes every message of every channel with the official packages, from
// nothing but the file itself, once by its index and once as a stream, and compares all values.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import omgidlParser from "@foxglove/omgidl-parser";
import omgidlSerialization from "@foxglove/omgidl-serialization";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const [recordingPath, expectedPath] = process.argv.slice(2);
const file = readFileSync(recordingPath);
const expected = JSON.parse(readFileSync(expectedPath, "utf8"));

await zstd.isLoaded;
const decompressHandlers = { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) };

// 64-bit integers as decimal strings, typed arrays as arrays: as the JSON has them.
function plain(value) {
  if (typeof value === "bigint") return value.toString();
  if (ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (Array.isArray(value)) return value.map(plain);
  if (typeof value === "object" && value !== null) {
    return Object.fromEntries(Object.entries(value).map(([key, member]) => [key, plain(member)]));
  }
  return value;
}

class Decoder {
  #channels = new Map();

  addChannel(channel, schema) {
    assert.equal(schema.encoding, "omgidl");
    assert.equal(channel.messageEncoding, "cdr");
    const definitions = omgidlParser.parseIDL(new TextDecoder().decode(schema.data));
    this.#channels.set(channel.id, {
      topic: channel.topic,
      type: schema.name,
      reader: new omgidlSerialization.MessageReader(schema.name, definitions),
    });
  }

  types() {
    return Object.fromEntries([...this.#channels.values()].map(({ topic, type }) => [topic, type]));
  }

  decode(message) {
    const { topic, reader } = this.#channels.get(message.channelId);
    return {
      channel: topic,
      logTime: message.logTime.toString(),
      publishTime: message.publishTime.toString(),
      sequence: message.sequence,
      value: plain(reader.readMessage(message.data)),
    };
  }
}

function compare(how, decoder, messages) {
  assert.deepEqual(decoder.types(), expected.channels, how);
  assert.equal(messages.length, expected.messages.length, how);
  messages.forEach((message, i) => assert.deepEqual(message, expected.messages[i], `${how}: message ${i}`));
  console.log(`${how}: ${messages.length} messages of ${Object.keys(expected.channels).length} channels are right`);
}

{
  const readable = {
    size: async () => BigInt(file.length),
    read: async (offset, size) => new Uint8Array(file.buffer, file.byteOffset + Number(offset), Number(size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoder = new Decoder();
  for (const channel of reader.channelsById.values()) {
    decoder.addChannel(channel, reader.schemasById.get(channel.schemaId));
  }
  assert.ok(reader.chunkIndexes.length > 1, "the recording has several chunks");
  assert.equal(reader.statistics.messageCount, BigInt(expected.messages.length));
  const messages = [];
  for await (const message of reader.readMessages()) messages.push(decoder.decode(message));
  compare("by index", decoder, messages);

  const attachments = {};
  for await (const attachment of reader.readAttachments()) {
    attachments[attachment.name] = new TextDecoder().decode(attachment.data);
  }
  assert.deepEqual(attachments, expected.attachments);
}

{
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const schemas = new Map();
  const decoder = new Decoder();
  const messages = [];
  reader.append(file);
  for (let record; (record = reader.nextRecord()) !== undefined; ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") decoder.addChannel(record, schemas.get(record.schemaId));
    if (record.type === "Message") messages.push(decoder.decode(record));
  }
  assert.ok(reader.done());
  compare("as a stream", decoder, messages);
}
