// SPDX-License-Identifier: Apache-2.0
// Messages of every topic, decoded by ROS 2's JavaScript decoder with the definitions in the file, have the written values.
//     node values_peer.js MESSAGE_SAMPLE
"use strict";
const assert = require("node:assert");
const { execFileSync } = require("node:child_process");
const crypto = require("node:crypto");
const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

// All numbers and texts of a message, in the order of its definition.
function* values(value) {
  if (typeof value === "bigint") yield String(value);
  else if (typeof value !== "object") yield value;
  else if (Array.isArray(value) || ArrayBuffer.isView(value)) for (const element of value) yield* values(element);
  else if ("nsec" in value || "nanosec" in value)
    yield String(BigInt(value.sec) * 1000000000n + BigInt(value.nsec ?? value.nanosec));
  else for (const member of Object.values(value)) yield* values(member);
}

async function main(file) {
  const seed = process.env.TANDEM_SEED ?? String(crypto.randomInt(2 ** 31));
  console.log(`TANDEM_SEED=${seed}`);
  const printed = execFileSync(process.argv[2], [file, seed], { encoding: "utf8", maxBuffer: 1 << 28 });
  const expected = printed
    .trim()
    .split("\n")
    .map((line) => JSON.parse(line));
  const bytes = fs.readFileSync(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
  };
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  let count = 0;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const schema = reader.schemasById.get(reader.channelsById.get(message.channelId).schemaId);
    assert.equal(schema.encoding, "ros2msg");
    if (!decoders.has(schema.id)) {
      decoders.set(schema.id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
    }
    const found = [schema.name, ...values(decoders.get(schema.id).readMessage(message.data))];
    assert.deepStrictEqual(found, expected[count++], schema.name);
  }
  assert.equal(count, expected.length);
  assert.ok(count > 100);
  console.log(`${count} messages of ${decoders.size} types: the same values`);
}

const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tandem-values-"));
main(path.join(folder, "a.mcap"))
  .finally(() => fs.rmSync(folder, { recursive: true }))
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
