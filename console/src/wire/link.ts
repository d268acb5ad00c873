// SPDX-License-Identifier: Apache-2.0
/** WebSocket to the server: connection, reconnection, subscriptions, publications. */
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

import {
  advertiseText,
  kSubprotocols,
  milliseconds,
  parseBinary,
  parseText,
  publishFrame,
  subscribeText,
} from "./protocol";
import type { ServerChannel } from "./protocol";
import type { Sample } from "./samples";
import { writable } from "./strings";

export type LinkState = "connecting" | "open" | "closed";

/** Samples per second that panels and scene draw. */
const kDrawnRate = 20;

/** Latest sample of one topic. Decoded on access, so that a topic costs no more than the display. */
export class Slot {
  /** performance.now() of the last sample; -1: none since the connection. */
  at = -1;
  /** When the server received it, by its clock, ms since 1970. */
  time = 0;
  count = 0;
  bytes = 0;
  /** Of the server's advertisement; -1: none yet. */
  channel = -1;
  private frame: DataView | null = null;
  private decoded: unknown = undefined;
  reader: MessageReader | null = null;

  constructor(
    readonly topic: string,
    private readonly listener: ((message: never, time: number) => void) | undefined,
    readonly rate: number,
    private readonly broken: (why: string) => void,
  ) {}

  put(payload: DataView, now: number, time: number): void {
    this.at = now;
    this.time = time;
    this.count += 1;
    this.bytes += payload.byteLength;
    this.frame = payload;
    this.decoded = undefined;
    const message = this.listener ? this.value<never>() : null;
    if (message !== null) this.listener!(message, time);
  }
  value<T>(): T | null {
    if (this.decoded === undefined && this.frame && this.reader) {
      try {
        this.decoded = this.reader.readMessage(this.frame);
      } catch (error) {
        this.decoded = null; // a bad sample does not prevent the display of later ones
        this.broken(`${this.topic}: a sample does not decode: ${String(error)}`);
      }
    }
    return (this.decoded as T | undefined) ?? null;
  }
  clear(): void {
    this.at = -1;
    this.frame = null;
    this.decoded = undefined;
  }
}

interface Publisher {
  channel: number;
  schemaName: string;
  schema: string;
  writer: MessageWriter;
}

/** Where samples come from: the link, or a recording. */
export interface Source {
  readonly state: LinkState;
  /** @param listener  receives every sample that comes, and when the server received it; without one only the latest is decoded */
  subscribe<T>(topic: string, listener?: (message: T, time: number) => void, rate?: number): Slot;
}

export interface LinkEvents {
  state(state: LinkState, reason: string): void;
  status(level: number, message: string): void;
  /** Before each further connection. @returns the session of the server that answers now, or null to end the link for ever */
  again(): Promise<string | null>;
}

const kRetryFirst = 250; // ms
const kRetryMost = 2000;
// With a stopped server the handshake does not end: after kOpeningLooks checks another one is begun. The server publishes its diagnostics
// every second: a link without data for kSilentLooks checks is interrupted. Counting checks instead of time keeps a pause of the page itself
// from closing the link: on a busy machine its first image takes seconds.
const kLook = 500; // ms
const kOpeningLooks = 8;
const kSilentLooks = 10;

const randomNumber = (): number => crypto.getRandomValues(new Uint32Array(1))[0]!;

export class Link implements Source {
  state: LinkState = "connecting";
  /** Why the last connection ended; empty while there is one. */
  ended = "";
  /** performance.now() of the last frame of any kind. */
  receivedAt = -1;
  private socket: WebSocket | null = null;
  private readonly slots = new Map<string, Slot>();
  private readonly bySubscription = new Map<number, Slot>();
  private readonly publishers = new Map<string, Publisher>();
  private nextId = 1;
  private retry = kRetryFirst;
  private bytesBefore = 0;

  constructor(
    private readonly url: string,
    /** Of the server that the page describes; another one is not listened to. */
    private session: string,
    private readonly events: LinkEvents,
  ) {}

  /** Before open(). A listener receives every sample that comes, and when the server received it; without one only the latest is decoded.
   * @param rate  maximum samples per second of a best-effort topic; between them, samples with events and peaks come (docs/foxglove.md) */
  subscribe<T>(topic: string, listener?: (message: T, time: number) => void, rate = kDrawnRate): Slot {
    const slot = new Slot(topic, listener, rate, (why) => this.events.status(2, why));
    this.slots.set(topic, slot);
    return slot;
  }
  /** A sample that came otherwise, decoded; null if its channel is not subscribed to. */
  decode({ channel, payload }: Sample): { topic: string; message: unknown } | null {
    const slot = [...this.slots.values()].find((one) => one.channel === channel);
    return slot?.reader ? { topic: slot.topic, message: slot.reader.readMessage(payload) } : null;
  }
  /** Of a subscribed topic. */
  slot = (topic: string): Slot | undefined => this.slots.get(topic);
  /** Before open(). The definition is parsed from the texts in idl/msg, against which C++ is tested. */
  publisher(topic: string, schemaName: string, schema: string): void {
    const writer = new MessageWriter(parse(schema, { ros2: true }));
    this.publishers.set(topic, { channel: this.nextId++, schemaName, schema, writer });
  }

  open(): void {
    this.change("connecting", "");
    const socket = new WebSocket(this.url, kSubprotocols);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    let opened = false;
    const closed = (reason: string): void => {
      clearInterval(watch);
      if (this.socket !== socket) return;
      this.socket = null;
      this.bySubscription.clear();
      for (const slot of this.slots.values()) slot.clear();
      this.change("closed", reason);
      this.later();
    };
    // Closing a socket whose peer is unreachable can take arbitrarily long: do not wait for it.
    const abandon = (reason: string): void => {
      closed(reason);
      socket.close();
    };
    let silent = 0;
    let before = this.receivedAt;
    const watch = setInterval(() => {
      silent = this.receivedAt === before ? silent + 1 : 0;
      before = this.receivedAt;
      if (silent >= (opened ? kSilentLooks : kOpeningLooks))
        abandon(opened ? `nothing was received for ${(kSilentLooks * kLook) / 1000} s` : "the server does not answer");
    }, kLook);
    socket.onopen = () => {
      opened = true;
      this.retry = kRetryFirst;
      for (const [topic, p] of this.publishers) socket.send(advertiseText(p.channel, topic, p.schemaName, p.schema));
      this.receivedAt = performance.now();
      this.change("open", "");
    };
    socket.onmessage = (event) => {
      if (this.socket !== socket) return;
      if (!this.received(event.data as string | ArrayBuffer)) abandon("a message of another system came");
    };
    socket.onclose = (event) =>
      closed(event.reason || (opened ? "connection to the server closed" : "the server does not answer"));
  }

  /** Opens the link again after a pause, unless another robot answers. */
  private later(): void {
    const pause = this.retry;
    this.retry = Math.min(2 * this.retry, kRetryMost);
    const open = async (): Promise<void> => {
      try {
        const session = await this.events.again();
        if (session === null) return;
        this.session = session;
        this.open();
      } catch {
        this.later(); // no server answers
      }
    };
    setTimeout(() => void open(), pause);
  }

  /** @returns false if it could not be sent; messages are not queued. */
  publish(topic: string, message: object): boolean {
    const publisher = this.publishers.get(topic);
    if (!publisher) throw new Error(`${topic}: not advertised`);
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(publishFrame(publisher.channel, publisher.writer.writeMessage(writable(message))));
    return true;
  }
  /** Bytes buffered by the socket: a sign of a slow link. */
  get backlog(): number {
    return this.socket?.bufferedAmount ?? 0;
  }
  /** Bytes received since the last call. */
  takeBytes(): number {
    let bytes = 0;
    for (const slot of this.slots.values()) bytes += slot.bytes;
    const taken = bytes - this.bytesBefore;
    this.bytesBefore = bytes;
    return taken;
  }

  private change(state: LinkState, reason: string): void {
    if (state === "open") this.ended = "";
    if (state === "closed") this.ended ||= reason; // that it cannot be opened again is not why it ended
    this.state = state;
    this.events.state(state, reason);
  }

  /** @returns whether it is of the server and the connection of this link; what is not is not used */
  private received(data: string | ArrayBuffer): boolean {
    if (typeof data !== "string") {
      const message = parseBinary(data);
      if (!message) return true; // of another kind
      const slot = this.bySubscription.get(message.subscription);
      if (!slot) return false;
      this.receivedAt = performance.now();
      slot.put(message.payload, this.receivedAt, milliseconds(message.logTime));
      return true;
    }
    const text = parseText(data);
    if (text?.sessionId !== this.session) return false;
    this.receivedAt = performance.now();
    if (text?.op === "advertise") text.channels.forEach((channel) => this.take(channel));
    if (text?.op === "status") this.events.status(text.level, text.message);
    return true;
  }

  private take(channel: ServerChannel): void {
    const slot = this.slots.get(channel.topic);
    if (!slot) return;
    if (channel.encoding !== "cdr" || (channel.schemaEncoding ?? "ros2msg") !== "ros2msg") {
      this.events.status(2, `${channel.topic}: encoding ${channel.encoding}, expected cdr with ros2msg`);
      return;
    }
    slot.reader = new MessageReader(parse(channel.schema, { ros2: true }));
    slot.channel = channel.id;
    // Samples carry nothing else of this connection: numbers that no other one has tell them from those of another system.
    const id = randomNumber();
    this.bySubscription.set(id, slot);
    this.socket?.send(subscribeText(id, channel.id, slot.rate));
  }
}
