// SPDX-License-Identifier: Apache-2.0
/** Foxglove WebSocket protocol: the messages that the page uses, without a socket. */

export const kSubprotocols = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

export interface ServerChannel {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
  schema: string;
  schemaEncoding?: string;
}

/** Text messages of the server; others are ignored. Each has the session of the server: new at every start. */
export type ServerText = { sessionId?: string } & (
  | { op: "serverInfo"; name: string; capabilities: string[] }
  | { op: "advertise"; channels: ServerChannel[] }
  | { op: "unadvertise"; channelIds: number[] }
  | { op: "status"; level: number; message: string; id?: string }
  | { op: "removeStatus"; statusIds: string[] }
);

export interface MessageData {
  subscription: number;
  /** Time at which the server received it from the robot, ns since 1970. */
  logTime: bigint;
  payload: DataView;
}

/** A time as ms since 1970, rounded once: whole milliseconds are exact, and the order of times stays. */
export const milliseconds = (nanoseconds: bigint): number =>
  Number(nanoseconds / 1_000_000n) + Number(nanoseconds % 1_000_000n) / 1e6;

const kMessageData = 0x01;
const kClientMessageData = 0x01;
const kHeader = 13; // opcode, u32 subscription, u64 time

/** @returns contents of a binary frame, or null for frames of other kinds and for too short ones. */
export function parseBinary(frame: ArrayBuffer): MessageData | null {
  if (frame.byteLength < kHeader) return null;
  const view = new DataView(frame);
  if (view.getUint8(0) !== kMessageData) return null;
  return {
    subscription: view.getUint32(1, true),
    logTime: view.getBigUint64(5, true),
    payload: new DataView(frame, kHeader),
  };
}

/** @returns null if the text is not JSON or has no operation. */
export function parseText(text: string): ServerText | null {
  try {
    const message = JSON.parse(text) as { op?: unknown };
    return typeof message.op === "string" ? (message as ServerText) : null;
  } catch {
    return null;
  }
}

export function publishFrame(channel: number, payload: Uint8Array): ArrayBuffer {
  const frame = new ArrayBuffer(5 + payload.byteLength);
  const view = new DataView(frame);
  view.setUint8(0, kClientMessageData);
  view.setUint32(1, channel, true);
  new Uint8Array(frame, 5).set(payload);
  return frame;
}

/** @param rate  maximum samples per second of a best-effort topic: an addition to the protocol */
export const subscribeText = (id: number, channelId: number, rate: number): string =>
  JSON.stringify({ op: "subscribe", subscriptions: [{ id, channelId, rate }] });

export const advertiseText = (id: number, topic: string, schemaName: string, schema: string): string =>
  JSON.stringify({
    op: "advertise",
    channels: [{ id, topic, encoding: "cdr", schemaName, schema, schemaEncoding: "ros2msg" }],
  });
