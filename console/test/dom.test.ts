// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { readable } from "../src/panels/dom";

test("a text with characters that reorder it shows them, and all others as they are", () => {
  expect(readable("\u202egnp.exe \u2067x\u2069 \u200fy")).toBe("\ufffdgnp.exe \ufffdx\ufffd \ufffdy");
  expect(readable("5 µm, 中, שלום, مرحبا")).toBe("5 µm, 中, שלום, مرحبا");
});
