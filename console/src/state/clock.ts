// SPDX-License-Identifier: Apache-2.0
/** Round-trip time to control, measured with the clock request that all services answer. */
import type { Link } from "../wire/link";
import type { ClockReply } from "../wire/messages";
import { randomIdentity } from "./commander";
import type { Robot } from "./robot";
import { mayCommand } from "./robot";

const kPeriod = 500; // ms
const kForget = 20; // requests

export class Clock {
  private readonly client = randomIdentity();
  private readonly asked = new Map<bigint, number>();
  private request = 0n;

  constructor(
    private readonly robot: Robot,
    private readonly link: Link,
    private readonly tell: (milliseconds: number) => void,
  ) {
    link.subscribe<ClockReply>(`/${robot.prefix}/clock/reply`, (reply) => this.answered(reply));
  }

  start(): void {
    if (mayCommand(this.robot)) setInterval(() => this.ask(), kPeriod);
  }
  private ask(): void {
    this.request += 1n;
    if (!this.link.publish(`/${this.robot.prefix}/clock/request`, { client: this.client, request: this.request }))
      return;
    this.asked.set(this.request, performance.now());
    this.asked.delete(this.request - BigInt(kForget));
  }
  private answered(reply: ClockReply): void {
    const at = reply.client === this.client && reply.process === "control" ? this.asked.get(reply.request) : undefined;
    if (at === undefined) return;
    this.asked.delete(reply.request);
    this.tell(performance.now() - at);
  }
}
