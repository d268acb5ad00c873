// SPDX-License-Identifier: Apache-2.0
/** Samples of the past as the server packs them in one answer: each with its length, in the frame of the WebSocket. */
import { milliseconds, parseBinary } from "./protocol";

export interface Sample {
  /** Of the server's advertisement. */
  channel: number;
  /** When it was received, ms since 1970 by the server's clock. */
  time: number;
  payload: DataView;
}
export interface Samples {
  /** ms since 1970: up to here these are all. */
  reached: number;
  samples: Sample[];
}

const kHead = 8;
const kLength = 4;

/** @throw Error if it is no such answer */
export function parseSamples(answer: ArrayBuffer): Samples {
  const view = new DataView(answer);
  const samples: Sample[] = [];
  if (answer.byteLength < kHead) throw new Error("samples: the answer is too short");
  for (let at = kHead; at < answer.byteLength;) {
    const length = at + kLength <= answer.byteLength ? view.getUint32(at, true) : Infinity;
    at += kLength;
    if (at + length > answer.byteLength) throw new Error("samples: the answer ends within a sample");
    const frame = parseBinary(answer.slice(at, at + length));
    if (!frame) throw new Error("samples: found something else in the answer");
    samples.push({ channel: frame.subscription, time: milliseconds(frame.logTime), payload: frame.payload });
    at += length;
  }
  return { reached: milliseconds(view.getBigUint64(0, true)), samples };
}
