// SPDX-License-Identifier: Apache-2.0
/** Client of control: numbered requests matched with their replies, and the control lease, renewed as by `tandem`. */
import type { Link } from "../wire/link";
import type { ControlStatus, Reply } from "../wire/messages";
import { ControlKind, allArms, PlanningKind } from "../wire/messages";
import { messages } from "../wire/definitions";
import type { Robot } from "./robot";
import { mayCommand } from "./robot";

export interface Answer {
  accepted: boolean;
  code: number;
  /** For people. */
  reason: string;
  value: number;
  /** Time from request to reply, ms. */
  took: number;
}

interface Pending {
  asked: number;
  resolve(answer: Answer): void;
  timer: ReturnType<typeof setTimeout>;
}

const kAnswerTime = 5000; // ms

export function randomIdentity(): bigint {
  const parts = crypto.getRandomValues(new BigUint64Array(1));
  return parts[0]! | 1n; // never 0, which means no client
}

export class Commander {
  /** New with every connection: a lease of the former connection is not reused. */
  client = randomIdentity();
  /** Whether this client has the lease, according to control's replies. */
  holds = false;
  private nextRequest = 1n;
  private readonly pending = new Map<bigint, Pending>();
  private keeper: ReturnType<typeof setInterval> | undefined;
  private stops = 0n;
  private readonly topic: (name: string) => string;
  private readonly fingerprint: bigint;

  constructor(
    private readonly robot: Robot,
    private readonly link: Link,
    private readonly lost: (why: string) => void,
  ) {
    this.fingerprint = BigInt(`0x${robot.fingerprint}`);
    this.topic = (name) => `/${robot.prefix}/${name}`;
    for (const m of messages)
      if (mayCommand(robot) || m.viewers) link.publisher(this.topic(m.topic), m.schemaName, m.schema);
    for (const replies of ["control/reply", "planning/reply", "sim/reply", "hal/reply"]) {
      link.subscribe<Reply>(this.topic(replies), (reply) => this.answered(reply));
    }
  }

  /** The link is down: all requests fail and the lease is lost. Nothing is repeated automatically. */
  disconnected(): void {
    for (const [request, waiting] of [...this.pending]) {
      clearTimeout(waiting.timer);
      this.pending.delete(request);
      waiting.resolve({
        accepted: false,
        code: 8,
        reason: "the connection was lost before the reply arrived",
        value: 0,
        took: 0,
      });
    }
    if (this.holds) this.drop("the connection was lost; this page no longer commands");
    this.client = randomIdentity();
  }

  /** The lease owner in control's status overrides the replies. */
  received(status: ControlStatus): void {
    this.seen = status;
    if (
      this.holds &&
      status.lease_owner !== this.client &&
      performance.now() - this.acquiredAt > 1000 * this.robot.budgets.lease
    )
      this.drop(
        status.lease_owner === 0n ? "the control lease has expired" : "another client has the control lease now",
      );
  }
  private acquiredAt = 0;
  private seen: ControlStatus | undefined;

  private drop(why: string): void {
    this.holds = false;
    clearInterval(this.keeper);
    this.lost(why);
  }

  async acquire(): Promise<Answer> {
    const answer = await this.control(ControlKind.acquireLease, {});
    if (answer.accepted) {
      this.holds = true;
      this.acquiredAt = performance.now();
      clearInterval(this.keeper);
      this.keeper = setInterval(() => this.keep(), 200 * this.robot.budgets.lease);
    }
    return answer;
  }
  async release(): Promise<Answer> {
    const answer = await this.control(ControlKind.releaseLease, {});
    if (answer.accepted) {
      clearInterval(this.keeper);
      this.holds = false;
    }
    return answer;
  }
  /** While nobody sees the page, its lease ends: who cannot see the robot does not command it. */
  private keep(): void {
    if (document.visibilityState === "hidden") return;
    this.link.publish(this.topic("control/request"), {
      ...emptyControl,
      ...this.echo(),
      fingerprint: this.fingerprint,
      client: this.client,
      kind: ControlKind.keepLease,
    });
  }

  state(command: string, arm = allArms): Promise<Answer> {
    return this.control(ControlKind.stateCommand, { value: command, arm });
  }
  method(name: string): Promise<Answer> {
    return this.control(ControlKind.setMethod, { text: name });
  }
  parameter(name: string, value: string): Promise<Answer> {
    return this.control(ControlKind.setParameter, { text: name, value });
  }
  /** Moves to the home configuration of the robot file. */
  home(): Promise<Answer> {
    return this.control(ControlKind.home, {});
  }
  hold(): Promise<Answer> {
    return this.control(ControlKind.hold, {});
  }
  /** Valid for the teleoperation budget or two control periods, whichever is larger: repeated while the button is held. */
  jog(arm: number, joints: number[]): Promise<Answer> {
    const padded = new Float64Array(8);
    padded.set(joints);
    return this.control(ControlKind.jog, { arm, joint_count: joints.length, joints: padded });
  }
  start(yaml: string): Promise<Answer> {
    return this.planning(PlanningKind.start, yaml);
  }
  pauseTrajectory(): Promise<Answer> {
    return this.planning(PlanningKind.pause, "");
  }
  resumeTrajectory(): Promise<Answer> {
    return this.planning(PlanningKind.resume, "");
  }
  stopTrajectory(): Promise<Answer> {
    return this.planning(PlanningKind.stop, "");
  }
  /** The drives home while the request is repeated. */
  homeDrives(): Promise<Answer> {
    return this.ask("hal/request", { kind: 1, arm: allArms });
  }
  /** For every client, with or without the lease. @returns false if it could not be sent. */
  stop(reason: string): boolean {
    return this.link.publish(this.topic("stop"), { client: this.client, sequence: ++this.stops, reason });
  }

  private control(kind: number, what: object): Promise<Answer> {
    return this.ask("control/request", { ...emptyControl, ...this.echo(), kind, ...what });
  }
  /** What every request repeats of the last control/status, by which control measures its age. */
  private echo(): object {
    return { control_session: this.seen?.session ?? 0n, answers_control: this.seen?.sequence ?? 0n };
  }
  private planning(kind: number, trajectory: string): Promise<Answer> {
    return this.ask("planning/request", { kind, trajectory, planned: 0 });
  }

  /** Asks planning to compute; progress and result carry the number of the request. Needs no lease: nothing moves. */
  compute(what: object): { request: bigint; answer: Promise<Answer> } {
    const request = this.nextRequest++;
    return {
      request,
      answer: this.ask("planning/compute", { ...emptyComputation, computation: 0n, ...what }, request),
    };
  }
  /** Cancels a computation of this client, or keeps it alive. */
  tellComputation(kind: number, computation: bigint): void {
    this.link.publish(this.topic("planning/compute"), {
      ...emptyComputation,
      fingerprint: this.fingerprint,
      client: this.client,
      request: this.nextRequest++,
      kind,
      computation,
    });
  }

  private ask(topic: string, what: object, request = this.nextRequest++): Promise<Answer> {
    return new Promise((resolve) => {
      const fail = (reason: string): void => resolve({ accepted: false, code: 8, reason, value: 0, took: 0 });
      if (
        !this.link.publish(this.topic(topic), { ...what, fingerprint: this.fingerprint, client: this.client, request })
      ) {
        fail("not sent: there is no connection to the server");
        return;
      }
      const timer = setTimeout(() => {
        this.pending.delete(request);
        fail(`${topic.split("/")[0]} did not answer within ${kAnswerTime / 1000} s`);
      }, kAnswerTime);
      this.pending.set(request, { asked: performance.now(), resolve, timer });
    });
  }

  private answered(reply: Reply): void {
    const waiting = reply.client === this.client ? this.pending.get(reply.request) : undefined;
    if (!waiting) return;
    clearTimeout(waiting.timer);
    this.pending.delete(reply.request);
    waiting.resolve({
      accepted: reply.accepted !== 0,
      code: reply.code,
      reason: reply.reason,
      value: reply.value,
      took: performance.now() - waiting.asked,
    });
  }
}

const emptyComputation = {
  trajectory: "",
  joints: [],
  targets: [],
  stability: 0,
  arms_may_touch: 0,
  clearance: 0,
  port_radius: 0,
  port_depth: 0,
  accept: 0,
  starts: 0,
  seed: 0n,
  rehearse: "",
  parameters: [],
  smoothing: 0,
  tries: 0,
  translation_acceleration: 0,
  rotation_velocity: 0,
  rotation_acceleration: 0,
  time_limit: 0,
};

const emptyControl = {
  request: 0n,
  arm: allArms,
  text: "",
  value: "",
  joint_count: 0,
  joints: new Float64Array(8),
  control_session: 0n,
  answers_control: 0n,
};
