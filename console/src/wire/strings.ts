// SPDX-License-Identifier: Apache-2.0
/** Strings of messages as CDR carries them. */
const encoder = new TextEncoder();

/** A string that CdrWriter writes whole. It reserves a byte for each UTF-16 unit and writes as many bytes of the text in UTF-8: without the
 * padding, "5 µm: 12" became "5 µm: 1". The padding only enlarges the space, which the text itself fills. */
const padded = (text: string): string => text + "\0".repeat(encoder.encode(text).length - text.length);

/** The message with all its strings such that MessageWriter writes them whole. */
export function writable(message: unknown): unknown {
  if (typeof message === "string") return padded(message);
  if (Array.isArray(message)) return message.map(writable);
  if (message === null || typeof message !== "object" || ArrayBuffer.isView(message)) return message;
  return Object.fromEntries(Object.entries(message).map(([key, value]) => [key, writable(value)]));
}
