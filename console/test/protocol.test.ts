// SPDX-License-Identifier: Apache-2.0
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import { expect, test } from "vitest";

import { messages } from "../src/wire/definitions";
import type { Time } from "../src/wire/messages";
import { advertiseText, milliseconds, parseBinary, parseText, publishFrame, subscribeText } from "../src/wire/protocol";
import { seeded } from "./random";

test("message data: subscription, time and payload; anything else is no message", () => {
  const frame = new ArrayBuffer(16);
  const view = new DataView(frame);
  view.setUint8(0, 1);
  view.setUint32(1, 77, true);
  view.setBigUint64(5, 123456789012345678n, true);
  new Uint8Array(frame, 13).set([1, 2, 3]);
  const message = parseBinary(frame)!;
  expect(message.subscription).toBe(77);
  expect(message.logTime).toBe(123456789012345678n);
  expect([...new Uint8Array(message.payload.buffer, message.payload.byteOffset)]).toEqual([1, 2, 3]);
  const random = seeded();
  for (let run = 0; run < 300; ++run) {
    const bytes = Uint8Array.from({ length: Math.floor(20 * random()) }, () => 256 * random());
    const parsed = parseBinary(bytes.buffer);
    expect(parsed !== null).toBe(bytes.length >= 13 && bytes[0] === 1);
  }
});

test("text: operations, or nothing", () => {
  expect(parseText('{"op":"status","level":2,"message":"m"}')).toEqual({ op: "status", level: 2, message: "m" });
  for (const text of ["", "{", "null", "7", '{"op":7}', "[]"]) {
    let parsed: unknown = "not run";
    try {
      parsed = parseText(text);
    } catch {
      parsed = "thrown";
    }
    expect(parsed, text).toBe(null);
  }
});

test("what the page sends is what the protocol says", () => {
  const frame = new Uint8Array(publishFrame(9, Uint8Array.of(5, 6)));
  expect([...frame]).toEqual([1, 9, 0, 0, 0, 5, 6]);
  expect(JSON.parse(subscribeText(3, 4, 20))).toEqual({
    op: "subscribe",
    subscriptions: [{ id: 3, channelId: 4, rate: 20 }],
  });
  expect(JSON.parse(advertiseText(1, "/t", "a/msg/B", "uint8 x"))).toMatchObject({
    channels: [{ encoding: "cdr", schemaEncoding: "ros2msg" }],
  });
});

type Definitions = ReturnType<typeof parse>;

/** A message with random members; lists of unknown length have up to three. */
function anyMessage(all: Definitions, at: Definitions[number], random: () => number): Record<string, unknown> {
  const message: Record<string, unknown> = {};
  for (const field of at.definitions) {
    if (field.isConstant) continue;
    const part = all.find(({ name }) => field.isComplex && name === field.type);
    const one = (): unknown => {
      if (part) return anyMessage(all, part, random);
      if (field.type === "string") return Math.random().toString(36);
      if (field.type === "uint64" || field.type === "int64") return BigInt(Math.floor(random() * 2 ** 52));
      return field.type.startsWith("float") ? random() : Math.floor(256 * random());
    };
    const list = (): unknown[] => Array.from({ length: field.arrayLength ?? Math.floor(4 * random()) }, one);
    if (!field.isArray) message[field.name] = one();
    else message[field.name] = part ? list() : Float64Array.from(list() as number[]);
  }
  return message;
}

test.each(messages.map((m) => [m.topic, m] as const))("%s: every member survives the wire", (_, { schema }) => {
  const definition = parse(schema, { ros2: true });
  const random = seeded();
  const writer = new MessageWriter(definition);
  const reader = new MessageReader(definition);
  for (let run = 0; run < 50; ++run) {
    const message = anyMessage(definition, definition[0]!, random);
    expect(reader.readMessage(writer.writeMessage(message))).toEqual(message);
  }
});

test("a stamp has the members that its type names", () => {
  const definition = parse(
    "builtin_interfaces/Time stamp\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
    {
      ros2: true,
    },
  );
  const stamp: Time = { sec: 7, nanosec: 8 };
  const bytes = new MessageWriter(definition).writeMessage({ stamp });
  expect(new MessageReader(definition).readMessage(bytes)).toEqual({ stamp });
});

test("times of whole milliseconds are exact, and later times are not earlier", () => {
  const random = seeded();
  for (let k = 0; k < 10_000; ++k) {
    const whole = Math.floor(1.6e12 + 4e11 * random());
    expect(milliseconds(BigInt(whole) * 1_000_000n)).toBe(whole);
    const rest = Math.floor(1e6 * random());
    const at = milliseconds(BigInt(whole) * 1_000_000n + BigInt(rest));
    expect(Math.abs(at - whole - rest / 1e6)).toBeLessThanOrEqual(2 ** -13); // half of the last digit at 2^40
    expect(at).toBeGreaterThanOrEqual(whole);
    expect(at).toBeLessThanOrEqual(whole + 1);
  }
});
