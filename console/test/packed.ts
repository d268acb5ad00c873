// SPDX-License-Identifier: Apache-2.0
/** An answer with samples, as the server packs them. Times in ns. */
export function packed(
  reached: bigint,
  samples: readonly { channel: number; time: bigint; bytes: readonly number[] }[],
): ArrayBuffer {
  const out = new DataView(new ArrayBuffer(8 + samples.reduce((sum, { bytes }) => sum + 17 + bytes.length, 0)));
  out.setBigUint64(0, reached, true);
  let at = 8;
  for (const { channel, time, bytes } of samples) {
    out.setUint32(at, 13 + bytes.length, true);
    out.setUint8(at + 4, 1);
    out.setUint32(at + 5, channel, true);
    out.setBigUint64(at + 9, time, true);
    bytes.forEach((byte, k) => out.setUint8(at + 17 + k, byte));
    at += 17 + bytes.length;
  }
  return out.buffer;
}
