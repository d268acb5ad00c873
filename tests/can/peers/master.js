// SPDX-License-Identifier: Apache-2.0
// A CANopen master from the npm package canopen commands one drive of tandem-drive-sim from its boot-up to a motion, and checks
// its answers.
//
//   node master.js INTERFACE NODE SERIAL
//
// Prints the results as one JSON object; exit code 1 with the reason if something differs from CiA 301.
"use strict";
const assert = require("assert");
const { Device, DataType } = require("canopen");
const { createRawChannel } = require("socketcan");

const [name, nodeText, serial] = process.argv.slice(2);
const node = Number(nodeText),
  OWN = 127,
  TIMEOUT = 5000;
const channel = createRawChannel(name);
const device = new Device({ id: OWN });
const seen = { boots: 0, states: new Set(), emergencies: [], pdos: 0 };

device.on("message", (message) => channel.send(message));
channel.addListener("onMessage", (message) => {
  if (message.id === 0x700 + node) {
    assert.strictEqual(message.data.length, 1);
    seen.boots += message.data[0] === 0;
    seen.states.add(message.data[0]);
  }
  device.receive(message);
});

const delay = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
async function until(what, condition) {
  const end = Date.now() + TIMEOUT;
  while (!(await condition())) {
    assert(Date.now() < end, `waited in vain until ${what}`);
    await delay(5);
  }
}
const read = (index, subIndex, dataType) =>
  device.sdo.upload({ deviceId: node, index, subIndex, dataType, timeout: TIMEOUT });
const write = (index, subIndex, data, dataType) =>
  device.sdo.download({ deviceId: node, index, subIndex, data, dataType, timeout: TIMEOUT });

// The abort code of a transfer.
async function aborted(transfer) {
  try {
    await transfer;
  } catch (error) {
    return error.code;
  }
  return null;
}

async function objects() {
  assert.strictEqual(await read(0x1000, 0, DataType.UNSIGNED32), 0x00020192);
  assert.strictEqual(await read(0x1018, 4, DataType.UNSIGNED32), Number(serial));
  const text = await read(0x1008, 0, DataType.VISIBLE_STRING); // segmented
  assert(text.length > 4, `device name ${JSON.stringify(text)}`);
  for (const value of [-123456, 0, 123456]) {
    await write(0x607d, 1, value - 200000, DataType.INTEGER32);
    assert.strictEqual(await read(0x607d, 1, DataType.INTEGER32), value - 200000);
  }
  const codes = {
    noObject: await aborted(read(0x5fff, 0)),
    noSubIndex: await aborted(read(0x1018, 9)),
    readOnly: await aborted(write(0x6041, 0, 1, DataType.UNSIGNED16)),
    tooLong: await aborted(write(0x6040, 0, 1, DataType.UNSIGNED32)),
    tooShort: await aborted(write(0x607a, 0, 1, DataType.UNSIGNED16)),
    range: await aborted(write(0x6060, 0, 99, DataType.INTEGER8)),
  };
  assert.strictEqual(codes.noObject, 0x06020000);
  assert.strictEqual(codes.noSubIndex, 0x06090011);
  assert.strictEqual(codes.readOnly, 0x06010002);
  assert([0x06070010, 0x06070012].includes(codes.tooLong), `too long: ${codes.tooLong}`);
  assert([0x06070010, 0x06070013].includes(codes.tooShort), `too short: ${codes.tooShort}`);
  assert((codes.range & 0xffffff00) === 0x06090000, `range: ${codes.range}`);
  // The drives do not support block transfers: the answer is an abort, not silence.
  const block = await aborted(
    device.sdo.upload({ deviceId: node, index: 0x1008, timeout: TIMEOUT, blockTransfer: true }),
  );
  assert.strictEqual(block, 0x05040001);
  return { name: text, codes };
}

// The default PDOs; the master's own objects from 2000 mirror the drive's.
function mirrors() {
  const add = (index, parameterName, dataType) => device.eds.addEntry(index, { parameterName, dataType });
  const statusword = add(0x2000, "statusword", DataType.UNSIGNED16);
  const actual = add(0x2001, "actual", DataType.INTEGER32);
  const controlword = add(0x2002, "controlword", DataType.UNSIGNED16);
  const target = add(0x2003, "target", DataType.INTEGER32);
  device.eds.addReceivePdo({ cobId: 0x180 + node, dataObjects: [statusword, actual] });
  device.eds.addTransmitPdo({ cobId: 0x200 + node, transmissionType: 1, dataObjects: [controlword, target] });
  device.eds.setSyncCobId(0x80);
  device.eds.setSyncGenerationEnable(true);
  return { statusword, actual, controlword, target };
}

async function mapPdo(base, id, entries) {
  await write(base, 1, (id | 0x80000000) >>> 0, DataType.UNSIGNED32);
  await write(base + 0x200, 0, 0, DataType.UNSIGNED8);
  for (const [k, entry] of entries.entries()) await write(base + 0x200, k + 1, entry, DataType.UNSIGNED32);
  await write(base + 0x200, 0, entries.length, DataType.UNSIGNED8);
  await write(base, 2, 1, DataType.UNSIGNED8);
  await write(base, 1, id, DataType.UNSIGNED32);
}

async function motion(mirror) {
  await mapPdo(0x1400, 0x200 + node, [0x60400010, 0x607a0020]);
  await mapPdo(0x1800, 0x180 + node, [0x60410010, 0x60640020]);
  await write(0x607d, 1, -1000000, DataType.INTEGER32);
  await write(0x607d, 2, 1000000, DataType.INTEGER32);
  await write(0x60c2, 1, 10, DataType.UNSIGNED8);
  await write(0x6060, 0, 8, DataType.INTEGER8);
  await until("the mode is shown", async () => (await read(0x6061, 0, DataType.INTEGER8)) === 8);
  device.nmt.startNode(node);
  await until("the node is operational", () => seen.states.has(5));
  device.nmt.startNode(); // this node
  const start = await read(0x6064, 0, DataType.INTEGER32);
  mirror.target.value = start;
  device.pdo.on("pdo", () => ++seen.pdos);
  const cycle = setInterval(() => {
    device.pdo.write(0x200 + node);
    device.sync.write();
  }, 10);
  for (const [word, state] of [
    [0x06, 0x21],
    [0x07, 0x23],
    [0x0f, 0x27],
  ]) {
    mirror.controlword.value = word;
    await until(`the state is ${state.toString(16)}`, () => (mirror.statusword.value & 0x6f) === state);
  }
  await until("the drive follows", () => (mirror.statusword.value & 0x1000) !== 0);
  for (let k = 0; k < 50; ++k) {
    mirror.target.value += 20;
    await delay(10);
  }
  await until("the drive is there", () => Math.abs(mirror.actual.value - start - 1000) <= 2);
  mirror.controlword.value = 0;
  await until("the drive is off", () => (mirror.statusword.value & 0x4f) === 0x40);
  clearInterval(cycle);
  return mirror.actual.value - start;
}

async function main() {
  device.eds.addSdoClientParameter(node, 0x600 + node, 0x580 + node);
  device.eds.addHeartbeatConsumer(node, 1000);
  const mirror = mirrors();
  channel.start();
  device.start();
  device.nmt.resetCommunication(node);
  await until("the boot-up message comes", () => seen.boots === 1);
  const found = await objects();
  await write(0x1017, 0, 50, DataType.UNSIGNED16);
  await until("the heartbeat says pre-operational", () => seen.states.has(127));
  found.moved = await motion(mirror);
  found.pdos = seen.pdos;
  device.nmt.stopNode(node);
  await until("the heartbeat says stopped", () => seen.states.has(4));
  device.nmt.resetNode(node);
  await until("the node boots again", () => seen.boots === 2);
  console.log(JSON.stringify(found));
}

main().then(
  () => process.exit(0),
  (error) => {
    console.error(error);
    process.exit(1);
  },
);
