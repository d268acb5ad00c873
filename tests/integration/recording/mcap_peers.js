// SPDX-License-Identifier: Apache-2.0
// MCAP files of this project read by @mcap/core, complete and truncated anywhere; its files read by this project's reader.
//     node mcap_peers.js MCAP_SAMPLE
"use strict";
const assert = require("node:assert");
const { execFileSync } = require("node:child_process");
const crypto = require("node:crypto");
const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const { crc32 } = require("@foxglove/crc");
const zstd = require("@foxglove/wasm-zstd");
const { McapIndexedReader, McapStreamReader, McapWriter } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

const sample = process.argv[2];
const ROUNDS = 5;
const CUTS = 20; // per round

// Seeded random number generator (mulberry32).
const seed = Number(process.env.TANDEM_SEED ?? crypto.randomInt(2 ** 32));
console.log(`TANDEM_SEED=${seed}`);
let state = seed;
const random = (bound) => {
  state = (state + 0x6d2b79f5) | 0;
  let t = Math.imul(state ^ (state >>> 15), 1 | state);
  t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
  return ((t ^ (t >>> 14)) >>> 0) % bound;
};

const describe = (topic, m) => [topic, m.sequence, String(m.logTime), m.data.length, crc32(m.data)];
const ours = (...words) => JSON.parse(execFileSync(sample, words, { maxBuffer: 1 << 28 }));
const readable = (bytes) => ({
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
});

async function indexed(bytes, decompressHandlers) {
  const reader = await McapIndexedReader.Initialize({ readable: readable(bytes), decompressHandlers });
  const found = { messages: [], attachments: {}, notes: {} };
  for await (const m of reader.readMessages({ validateCrcs: true })) {
    found.messages.push(describe(reader.channelsById.get(m.channelId).topic, m));
  }
  for await (const a of reader.readAttachments({ validateCrcs: true })) found.attachments[a.name] = crc32(a.data);
  for await (const m of reader.readMetadata()) found.notes[m.name] = m.metadata.get("value");
  assert.equal(reader.header.profile, "ros2");
  assert.equal(Number(reader.statistics.messageCount), found.messages.length);
  assert.equal(reader.statistics.channelCount, reader.channelsById.size);
  assert.equal(reader.statistics.schemaCount, reader.schemasById.size);
  assert.equal(reader.statistics.chunkCount, reader.chunkIndexes.length);
  assert.equal(reader.statistics.attachmentCount, reader.attachmentIndexes.length);
  for (const channel of reader.channelsById.values()) {
    assert.equal(channel.messageEncoding, "cdr");
    assert.ok(channel.metadata.get("offered_qos_profiles"));
  }
  return found;
}

function streamed(bytes, decompressHandlers) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  const found = { messages: [], attachments: {}, notes: {} };
  const topics = new Map();
  let dataCrc;
  reader.append(Uint8Array.from(bytes)); // a copy, since the reader writes into its input
  for (let record; (record = reader.nextRecord());) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "Message") found.messages.push(describe(topics.get(record.channelId), record));
    if (record.type === "Attachment") found.attachments[record.name] = crc32(record.data);
    if (record.type === "Metadata") found.notes[record.name] = record.metadata.get("value");
    if (record.type === "DataEnd") dataCrc = record.dataSectionCrc;
  }
  return { found, done: reader.done(), dataCrc };
}

// Start of the DataEnd record (13 bytes) of a complete file, computed from the start of the summary in the footer.
const dataEnd = (bytes) => Number(bytes.readBigUInt64LE(bytes.length - 28)) - 13;

async function foreign(file, options) {
  const stream = fs.openSync(file, "w");
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (buffer) => {
      fs.writeSync(stream, buffer);
      position += BigInt(buffer.length);
    },
  };
  const writer = new McapWriter({ writable, ...options });
  await writer.start({ profile: "ros2", library: "peer" });
  const schemaId = await writer.registerSchema({ name: "p/msg/A", encoding: "ros2msg", data: Buffer.from("uint8 x") });
  const written = [];
  const topics = ["/a", "/b", "/c"];
  const ids = [];
  for (const topic of topics) {
    ids.push(await writer.registerChannel({ topic, schemaId, messageEncoding: "cdr", metadata: new Map() }));
  }
  for (let i = 0; i < 300; ++i) {
    const k = random(topics.length);
    const data = crypto.randomBytes(random(900));
    const m = { channelId: ids[k], sequence: i, logTime: BigInt(i) * 1000n, publishTime: 0n, data };
    written.push(describe(topics[k], m));
    await writer.addMessage(m);
  }
  const data = Buffer.from("text");
  await writer.addAttachment({ name: "x", mediaType: "text/plain", logTime: 1n, createTime: 1n, data });
  await writer.addMetadata({ name: "n", metadata: new Map([["value", "v"]]) });
  await writer.end();
  fs.closeSync(stream);
  const read = ours("read", file);
  assert.deepStrictEqual(read.messages, written);
  assert.deepStrictEqual(read.attachments, { x: crc32(data) });
  assert.deepStrictEqual(read.notes, { n: "v" });
  assert.deepStrictEqual([read.finished, read.damage], [true, []]);
}

async function main(folder) {
  const handlers = await loadDecompressHandlers();
  await zstd.isLoaded;
  const file = path.join(folder, "a.mcap");
  for (let round = 0; round < ROUNDS; ++round) {
    const written = ours("write", file, String(random(2 ** 31)));
    const bytes = fs.readFileSync(file);
    assert.deepStrictEqual(await indexed(bytes, handlers), written, "by index");
    const whole = streamed(bytes, handlers);
    assert.deepStrictEqual(whole.found, written, "as a stream");
    assert.ok(whole.done);
    assert.equal(whole.dataCrc, crc32(bytes.subarray(0, dataEnd(bytes))), "checksum of the data section");
    for (let cut = 0; cut < CUTS; ++cut) {
      const part = bytes.subarray(0, 8 + random(bytes.length - 8));
      fs.writeFileSync(path.join(folder, "cut.mcap"), part);
      const peer = streamed(part, handlers).found;
      const own = ours("read", path.join(folder, "cut.mcap"));
      assert.ok(!own.finished);
      assert.deepStrictEqual(own.messages, peer.messages, `cut at ${part.length}`);
      assert.deepStrictEqual([own.attachments, own.notes], [peer.attachments, peer.notes]);
      assert.deepStrictEqual(peer.messages, written.messages.slice(0, peer.messages.length));
    }
  }
  const compressChunk = (data) => ({ compression: "zstd", compressedData: zstd.compress(data, 3) });
  await foreign(file, { chunkSize: 5000, compressChunk });
  await foreign(file, { chunkSize: 5000 });
  await foreign(file, { useChunks: false });
  console.log(`${ROUNDS} files whole, ${ROUNDS * CUTS} cut, 3 of another writer: the same contents`);
}

const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tandem-mcap-"));
main(folder)
  .finally(() => fs.rmSync(folder, { recursive: true }))
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
