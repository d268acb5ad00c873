// SPDX-License-Identifier: Apache-2.0
// Foxglove's own client connected to tandem-console: all channels, decoded; an accepted request; operations that a viewer may not use.
//     node foxglove_peer.js URL SUBPROTOCOL PREFIX watch|command   prints one JSON object
"use strict";
const assert = require("node:assert");
const { isDeepStrictEqual } = require("node:util");
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
const values = new Map(); // of parameters, by name
const answers = new Map(); // parameters by id of the request
const offered = new Map(); // services by name
const responses = new Map(); // by call
const graph = { publishers: new Map(), subscribers: new Map(), providers: new Map(), removed: new Set() };
let info;
let wake = () => {};

client.on("error", (error) => fail(error));
client.on("serverInfo", (event) => (info = event));
client.on("status", (event) => {
  statuses.push(event);
  wake();
});
client.on("parameterValues", ({ parameters, id }) => {
  for (const { name, value } of parameters) values.set(name, value);
  answers.set(id, parameters);
  wake();
});
client.on("advertiseServices", (added) => {
  for (const service of added) offered.set(service.name, service);
});
client.on("serviceCallResponse", (response) => {
  responses.set(response.callId, response);
  wake();
});
client.on("serviceCallFailure", (failure) => {
  responses.set(failure.callId, failure);
  wake();
});
client.on("connectionGraphUpdate", (update) => {
  for (const { name, publisherIds } of update.publishedTopics) graph.publishers.set(name, publisherIds);
  for (const { name, subscriberIds } of update.subscribedTopics) graph.subscribers.set(name, subscriberIds);
  for (const { name, providerIds } of update.advertisedServices) graph.providers.set(name, providerIds);
  for (const name of update.removedTopics) graph.removed.add(name);
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

// Calls a service as Foxglove does: with the definitions that the server has sent.
let calls = 0;
async function call(name, message, encoding = "cdr") {
  const { id, request, response } = offered.get(`/${prefix}/${name}`);
  const data = new MessageWriter(parse(request.schema, { ros2: true })).writeMessage(message);
  const callId = ++calls;
  client.sendServiceCallRequest({ serviceId: id, callId, encoding, data });
  await until(() => responses.has(callId), `an answer of ${name}`);
  const answer = responses.get(callId);
  if (answer.message) return answer;
  assert.equal(answer.encoding, "cdr");
  assert.equal(answer.serviceId, id);
  return new MessageReader(parse(response.schema, { ros2: true })).readMessage(answer.data);
}

async function ask(names) {
  const id = `get ${++calls}`;
  client.getParameters(names, id);
  await until(() => answers.has(id), "parameters");
  return answers.get(id);
}

const said = (pattern) => () => statuses.some(({ message }) => pattern.test(message));
const reported = (name) =>
  last
    .get(`/${prefix}/diagnostics`)
    .status.find((status) => status.name === "tandem-control")
    ?.values.find(({ key }) => key === `parameter ${name}`)?.value;

// Before the lease: values can be read, not set.
async function readParameters() {
  const all = await ask([]);
  const method = all.find(({ name }) => name === "method");
  assert.ok(/^[a-z-]+$/.test(method.value) && method.type === undefined, JSON.stringify(method));
  const zeta = all.find(({ name }) => name === "snsqp_zeta");
  assert.equal(zeta.type, "float64");
  assert.ok(zeta.value > 0);
  assert.deepEqual(await ask(["snsqp_zeta", "nothing"]), [zeta]);
  client.setParameters([{ name: "snsqp_zeta", value: 0.5 }], "early");
  await until(said(/this connection has no control lease/), "a refusal without any request");
  assert.deepEqual(await ask(["snsqp_zeta"]), [zeta]);
}

// As the owner of the lease. A stalled machine may lose it meanwhile: it is acquired again, and the values are set again.
async function setParameters(acquire) {
  async function set(parameters, condition, what) {
    const end = Date.now() + TIMEOUT;
    for (;;) {
      await acquire();
      const id = `set ${++calls}`;
      client.setParameters(parameters, id);
      await until(() => answers.has(id), what);
      if (condition(answers.get(id))) return;
      assert.ok(Date.now() < end, `${what}: ${JSON.stringify(statuses.slice(-3))}`);
    }
  }
  client.subscribeParameterUpdates(["snsqp_zeta"]);
  const zeta = { name: "snsqp_zeta", value: 0.0625, type: "float64" };
  await set([{ name: "snsqp_zeta", value: 0.0625 }], (now) => isDeepStrictEqual(now, [zeta]), "a value is set");
  await until(() => reported("snsqp_zeta") === "0.0625", "the value in control's own report");
  const refused = said(/^tip_gain: found.*expected a finite number above zero/);
  await set([{ name: "tip_gain", value: -1 }], ([gain]) => refused() && gain.value > 0, "the reason of control");
  await set([{ name: "method", value: "snsqp" }], ([method]) => method.value === "snsqp", "the method");
  client.setParameters([{ name: "nothing", value: 1 }]);
  await until(said(/nothing: unknown parameter/), "an unknown one");
  client.setParameters([{ name: "snsqp_zeta", value: "much" }]);
  await until(said(/^snsqp_zeta: found a text, expected a number/), "a text");
}

async function connections() {
  client.subscribeConnectionGraph();
  const has = (side, topic, pattern) => () =>
    (graph[side].get(`/${prefix}/${topic}`) ?? []).some((id) => pattern.test(id));
  await until(has("publishers", "control/status", /control/), "control publishes its status");
  await until(has("subscribers", "control/status", /^tandem-console$/), "the console reads it");
  await until(has("subscribers", "actuation/command", /sim/), "sim reads commands");
  await until(has("providers", "control/request", /control/), "control provides its service");
  for (const ids of [graph.publishers, graph.subscribers].flatMap((side) => [...side.values()]))
    assert.ok(
      ids.every((id) => id !== ""),
      `a process without a name: ${ids}`,
    );
  const id = client.advertise({
    topic: `/${prefix}/emergency_stop`,
    encoding: "cdr",
    schemaName: "std_msgs/msg/Bool",
  });
  await until(has("publishers", "emergency_stop", /^tandem-console$/), "a client publishes through the console");
  client.unadvertise(id);
  const others = () => (graph.publishers.get(`/${prefix}/emergency_stop`) ?? []).length === 0;
  await until(others, "it has withdrawn the topic");
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
  await connections();
  await readParameters();
  const early = await request("control", control, text(5, "snsqp"));
  assert.equal(early.accepted, 0, "nobody has the lease yet");
  client.setParameters([{ name: "snsqp_zeta", value: 0.5 }], "without the lease");
  await until(said(/snsqp_zeta: .*lease/), "control refuses a value without the lease");
  const { fingerprint } = last.get(`/${prefix}/actuation/state`);
  const lease = { fingerprint, client: ME, request: 1000n, ...text(1, "") };
  assert.match((await call("control/request", lease, "json")).message, /found encoding 'json', expected cdr/);
  assert.match((await call("control/request", { ...lease, client: 0n })).message, /client that is not 0/);
  const leased = await call("control/request", lease);
  assert.deepEqual([leased.client, leased.request, leased.accepted], [ME, 1000n, 1], "the lease");
  setInterval(() => control({ fingerprint, client: ME, request: 0n, ...text(3, "") }), 300).unref(); // keeps it
  await until(() => last.get(`/${prefix}/control/status`).lease_owner === ME, "control says who holds the lease");
  assert.equal((await request("control", control, text(5, "snsqp"))).accepted, 1, "a method");
  await until(() => last.get(`/${prefix}/control/status`).method === 4, "the method is in force");
  await setParameters(() => call("control/request", { ...lease, request: 1000n + BigInt(calls + 1), ...text(1, "") }));
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
  for (const capability of ["clientPublish", "parameters", "parametersSubscribe", "services", "connectionGraph"])
    assert.ok(info.capabilities.includes(capability), capability);
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
