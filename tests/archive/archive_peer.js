// SPDX-License-Identifier: Apache-2.0
// Recordings of older commits before @mcap/core and the decoder of the operator's page: the numbers are those of `tandem export`.
//     node archive_peer.js TANDEM FOLDER...
"use strict";
const assert = require("node:assert");
const { execFileSync } = require("node:child_process");
const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

const [tandem, ...folders] = process.argv.slice(2);

// {"tasks[0].position[1]": "0.5"}: numbers as the CSV file has them.
function flatten(value, name, found) {
  if (Array.isArray(value) || ArrayBuffer.isView(value))
    value.forEach((one, i) => flatten(one, `${name}[${i}]`, found));
  else if (value !== null && typeof value === "object")
    for (const [key, one] of Object.entries(value)) flatten(one, name === "" ? key : `${name}.${key}`, found);
  else if (typeof value !== "string") found[name] = Number(value);
  return found;
}

function exported(file, folder) {
  execFileSync(tandem, ["export", file, "--indices", "--csv", folder]);
  const tables = {};
  for (const name of fs.readdirSync(folder)) {
    const [head, ...rows] = fs
      .readFileSync(path.join(folder, name), "utf8")
      .trim()
      .split("\n")
      .map((row) => row.split(","));
    tables[path.parse(name).name] = rows.map((row) => Object.fromEntries(head.map((column, i) => [column, row[i]])));
  }
  return tables;
}

async function check(file, decompressHandlers) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tandem-archive-"));
  const tables = exported(file, folder);
  fs.rmSync(folder, { recursive: true });
  const bytes = fs.readFileSync(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  let compared = 0;
  for (const [id, channel] of reader.channelsById) {
    const name = channel.topic
      .replace(/^\/arch\//, "")
      .replace(/^\//, "")
      .replaceAll("/", "_");
    if (!/^(actuation_|control_|hal_|teleop_input)/.test(name)) continue; // texts with commas are in the others
    const schema = reader.schemasById.get(channel.schemaId);
    const decoder = new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
    for await (const message of reader.readMessages({ topics: [channel.topic] })) {
      if (message.channelId !== id) continue;
      const row = tables[name].find((one) => one.log_time_ns === String(message.logTime));
      for (const [column, value] of Object.entries(flatten(decoder.readMessage(message.data), "", {}))) {
        if (!(column in row)) continue;
        ++compared;
        const wanted = Number(row[column].replace("inf", "Infinity"));
        assert.ok(
          wanted === value || (row[column] === "nan" && Number.isNaN(value)),
          `${file}: ${channel.topic}: ${column}`,
        );
      }
    }
  }
  assert.ok(compared > 1000, file);
  console.log(`${path.basename(file)}: ${compared} numbers`);
}

async function main() {
  const decompressHandlers = await loadDecompressHandlers();
  for (const folder of folders)
    for (const name of fs.readdirSync(folder)) await check(path.join(folder, name), decompressHandlers);
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
