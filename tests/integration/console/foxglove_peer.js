// SPDX-License-Identifier: Apache-2.0
// Foxglove's own client connected to tandem-console: all channels, decoded; an accepted request; operations that a viewer may not use.
//     node foxglove_peer.js URL SUBPROTOCOL PREFIX watch|command   prints one JSON object
"use strict";
const assert = require("node:assert");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const WebSocket = require("ws");

const [url, subprotocol, prefix, task] = process.argv.slice(2);
const TIMEOUT = 40000; // ms
// Topics that are published while the robot is not commanded; `rosout` is triggered by a request that planning refuses.
const FLOWING = [
  "actuation/state",
  "actuation/command",
  "actuation/limits",
  "planning/reference",
  "control/status",
  "hal/status",
  "diagnostics",
  "markers",
  "arm_a/measured_js",
  "arm_a/measured_cp",
  "arm_b/setpoint_js",
  "arm_b/shape",
  "arm_a/operating_state",
].map((name) => `/${prefix}/${name}`);

const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const channels = new Map(); // by topic
const decoders = new Map(); // by channel id
const definitions = new Map(); // by topic
const subscribed = new Map(); // channel by subscription
const last = new Map(); // decoded message by topic
const counts = new Map();
const services = new Set(); // services that publish diagnostics
const statuses = [];
let info;
let wake = () => {};

client.on("error", (error) => fail(error));
client.on("serverInfo", (event) => (info = event));
client.on("status", (event) => {
  statuses.push(event);
  wake();
});
client.on("advertise", (added) => {
  for (const channel of added) {
    assert.equal(channel.encoding, "cdr");
    assert.equal(channel.schemaEncoding, "ros2msg");
    const definition = parse(channel.schema, { ros2: true });
    channels.set(channel.topic, channel);
    definitions.set(channel.topic, definition);
    decoders.set(channel.id, new MessageReader(definition));
    subscribed.set(client.subscribe(channel.id), channel);
  }
  wake();
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const channel = subscribed.get(subscriptionId);
  assert.ok(Math.abs(Number(timestamp / 1000000n) - Date.now()) < 600000, "log time is wall time");
  const message = decoders.get(channel.id).readMessage(data);
  last.set(channel.topic, message);
  counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
  if (channel.topic === `/${prefix}/diagnostics`) for (const status of message.status) services.add(status.name);
  wake();
});

function fail(error) {
  console.error(error);
  process.exit(1);
}

// Waits for the event that makes a condition true.
async function until(condition, what) {
  const end = Date.now() + TIMEOUT;
  while (!condition()) {
    if (Date.now() > end) throw new Error(`not within ${TIMEOUT} ms: ${what}; received ${[...counts.keys()]}`);
    await new Promise((resolve) => {
      wake = resolve;
      setTimeout(resolve, 250);
    });
  }
}

function publisher(name) {
  const topic = `/${prefix}/${name}`;
  const writer = new MessageWriter(definitions.get(topic));
  const id = client.advertise({ topic, encoding: "cdr", schemaName: channels.get(topic).schemaName });
  return (message) => client.sendMessage(id, writer.writeMessage(message));
}

const ME = 4242n;
let number = 0n;
async function request(name, publish, message) {
  const mine = ++number;
  const topic = `/${prefix}/${name}/reply`;
  last.delete(topic);
  const { fingerprint } = last.get(`/${prefix}/actuation/state`); // of the running robot
  publish({ fingerprint, client: ME, request: mine, ...message });
  await until(() => last.get(topic)?.client === ME && last.get(topic)?.request === mine, `${topic} to request ${mine}`);
  return last.get(topic);
}

// The log rate on the wire is limited: 50 lines at once and 20 per second pass, and the next line reports the dropped ones.
async function flood(planning) {
  const began = Date.now(),
    before = counts.get("/rosout");
  for (let i = 0; i < 100; ++i)
    await request("planning", planning, { kind: 1, trajectory: "no trajectory", planned: 0 });
  const passed = counts.get("/rosout") - before,
    seconds = (Date.now() - began) / 1000;
  assert.ok(passed >= Math.min(40, 20 * seconds) && passed <= 60 + 25 * seconds, `${passed} lines within ${seconds} s`);
  if (seconds > 2) return; // too slow a machine for the limit
  const reported = () => /earlier lines were dropped/.test(last.get("/rosout").msg);
  const end = Date.now() + TIMEOUT;
  while (!reported() && Date.now() < end)
    await request("planning", planning, { kind: 1, trajectory: "no trajectory", planned: 0 });
  assert.ok(reported(), "what is left out is reported");
}

async function command() {
  const control = publisher("control/request");
  const planning = publisher("planning/request");
  await until(() => last.has(`/${prefix}/control/status`), "control/status");
  const seen = () => last.get(`/${prefix}/control/status`);
  const text = (kind, words, value = "") => ({
    control_session: seen().session,
    answers_control: seen().sequence,
    kind,
    arm: 255,
    text: words,
    value,
    joint_count: 0,
    joints: new Array(8).fill(0),
  });
  const early = await request("control", control, text(5, "snsqp"));
  assert.equal(early.accepted, 0, "nobody has the lease yet");
  assert.equal((await request("control", control, text(1, ""))).accepted, 1, "the lease");
  await until(() => last.get(`/${prefix}/control/status`).lease_owner === ME, "control says who holds the lease");
  assert.equal((await request("control", control, text(5, "snsqp"))).accepted, 1, "a method");
  await until(() => last.get(`/${prefix}/control/status`).method === 4, "the method is in force");
  const refused = await request("planning", planning, { kind: 1, trajectory: "no trajectory", planned: 0 });
  assert.equal(refused.accepted, 0);
  await until(() => [last.get("/rosout")?.name, last.get("/rosout")?.level].join() === "tandem-planning,30", "/rosout");
  const log = last.get("/rosout").msg;
  await flood(planning);
  publisher("stop")({ client: ME, sequence: 1n, reason: "test" });
  await until(() => last.get(`/${prefix}/arm_a/operating_state`).state === "FAULT", "stop is obeyed");
  // Topics that no client may publish, not even operators.
  client.advertise({
    topic: `/${prefix}/actuation/command`,
    encoding: "cdr",
    schemaName: "tandem_msgs/msg/ActuationCommand",
  });
  await until(() => statuses.some((s) => s.message.includes("may not publish")), "a status for what is refused");
  return { reason: refused.reason, log };
}

async function main() {
  await until(() => info && channels.size > 0, "serverInfo and channels");
  assert.ok(info.capabilities.includes("clientPublish"));
  await until(() => FLOWING.every((topic) => last.has(topic)), `messages of ${FLOWING}`);
  await until(
    () => ["sim", "control", "planning", "recorder", "console"].every((s) => services.has(`tandem-${s}`)),
    "diagnostics of every service",
  );
  const found = task === "command" ? await command() : {};
  console.log(JSON.stringify({ channels: channels.size, received: counts.size, statuses, ...found }));
  client.close();
}

main().catch(fail);
