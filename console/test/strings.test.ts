// SPDX-License-Identifier: Apache-2.0
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import { expect, test } from "vitest";

import { writable } from "../src/wire/strings";
import { seeded } from "./random";

const kDefinition = parse(
  "uint8 before\nstring text\nfloat64 after\nPart[] parts\nstring[] names\n" +
    "================\nMSG: tandem_msgs/Part\nstring name\nuint32 number",
  { ros2: true },
);
const writer = new MessageWriter(kDefinition);
const reader = new MessageReader(kDefinition);
const kCharacters = ["a", "0", "\n", "µ", "é", "中", "𝄞", "\u202e", "€"];

test("strings of any characters arrive whole, and so does what follows them", () => {
  const random = seeded();
  for (let k = 0; k < 200; ++k) {
    const text = (): string =>
      Array.from(
        { length: Math.floor(random() * 12) },
        () => kCharacters[Math.floor(random() * kCharacters.length)],
      ).join("");
    const message = {
      before: 7,
      text: text(),
      after: random(),
      parts: [
        { name: text(), number: 3 },
        { name: text(), number: 4 },
      ],
      names: [text(), text()],
    };
    expect(reader.readMessage(writer.writeMessage(writable(message)))).toEqual(message);
  }
});

test("half a surrogate pair arrives as the replacement character", () => {
  const message = { before: 0, text: "a\ud800b", after: 1, parts: [], names: [] };
  expect(reader.readMessage(writer.writeMessage(writable(message)))).toEqual({ ...message, text: "a\ufffdb" });
});

test("arrays of numbers are left as they are", () => {
  const joints = Float64Array.of(1, 2);
  expect((writable({ joints, id: 5n, none: null }) as { joints: unknown }).joints).toBe(joints);
});
