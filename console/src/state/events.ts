// SPDX-License-Identifier: Apache-2.0
/** Events of the robot and of other clients, for the log: states, faults, stops, runs, requests, lines of the processes. */
import type { Link } from "../wire/link";
import { ControlKind, EmergencyStop, Phase } from "../wire/messages";
import type {
  ControlRequest,
  ControlStatus,
  DiagnosticArray,
  HalStatus,
  Identity,
  Log as ProcessLine,
  PlanningRequest,
  Reply,
  RunSummary,
  Stop,
} from "../wire/messages";
import type { Commander } from "./commander";
import { faultsOf, nameOf, shortName, stateName } from "./descriptions";
import type { Level, Log } from "./log";
import type { Robot } from "./robot";
import { describeSummary } from "./summary";

const kCrtkClients = 2n ** 64n - 1n;
const kAgain = 1000; // ms after which a repeated stop or jog is a new one
const kWarning = 30; // rcl_interfaces/Log
const kRequests = 100; // without reply

/** "client 1f3a": pages have no other name. */
export const clientName = (client: bigint): string =>
  client === kCrtkClients ? "CRTK clients" : `client ${(client & 0xffffn).toString(16).padStart(4, "0")}`;

/** What a request of a client asks for; empty for renewals of the lease. */
export function describeRequest(request: ControlRequest, arms: readonly string[]): string {
  const arm = request.arm < arms.length ? ` of arm ${shortName(arms[request.arm]!)}` : "";
  switch (request.kind) {
    case ControlKind.keepLease:
      return "";
    case ControlKind.stateCommand:
      return request.value + arm;
    case ControlKind.setMethod:
      return `method ${request.text}`;
    case ControlKind.setParameter:
      return `${request.text} = ${request.value}`;
    default:
      return nameOf("ControlKind", request.kind).replaceAll("_", " ") + arm;
  }
}

/** What has changed between two messages, for people. */
export function changesOf(before: ControlStatus, now: ControlStatus, arms: readonly string[]): [Level, string][] {
  const changes: [Level, string][] = [];
  arms.forEach((arm, k) => {
    const name = `Arm ${shortName(arm)}`;
    const [was, is] = [before.operating_state[k]!, now.operating_state[k]!];
    if (was !== is) changes.push(["info", `${name}: ${stateName(was)} → ${stateName(is)}`]);
    for (const fault of faultsOf((now.faults[k] ?? 0) & ~(before.faults[k] ?? 0)))
      changes.push(["alarm", `${name}: ${fault.name}: ${fault.meaning}. ${fault.remedy ?? ""}`.trim()]);
  });
  return changes;
}

export class Events {
  private status: ControlStatus | null = null;
  private pressed = false;
  private readonly names = new Map<bigint, string>();
  private readonly repeated = new Map<string, number>();
  private readonly asked = new Map<string, string>();
  private shownRun = "";

  constructor(
    private readonly robot: Robot,
    link: Link,
    private readonly commander: Commander,
    private readonly log: Log,
    /** Time of this page, ms since 1970, for one of the server's clock. */
    private readonly when: (time: number) => number,
  ) {
    const topic = (name: string): string => `/${robot.prefix}/${name}`;
    link.subscribe<Identity>(topic("identity"), (m) => {
      this.names.set(m.session, `tandem-${m.process} (pid ${m.pid} on ${m.host})`);
    });
    link.subscribe<Stop>(topic("stop"), (m, time) => this.stopped(m, time));
    link.subscribe<ControlRequest>(topic("control/request"), (m, time) => this.requested(m, time));
    link.subscribe<PlanningRequest>(topic("planning/request"), (m, time) =>
      this.note(m.client, m.request, `trajectory: ${nameOf("PlanningKind", m.kind)}`, time),
    );
    link.subscribe<ProcessLine>("/rosout", (m) => this.line(m));
  }

  private who(client: bigint): string {
    if (client === this.commander.client) return "this page";
    return this.names.get(client) ?? clientName(client);
  }

  /** Whether this is not a repetition of what was noted a moment ago. */
  private fresh(what: string, time: number): boolean {
    const last = this.repeated.get(what) ?? 0;
    this.repeated.set(what, time);
    return time - last > kAgain;
  }

  private stopped({ client, reason }: Stop, time: number): void {
    if (client === this.commander.client || !this.fresh(`stop ${client}`, time)) return;
    this.log.add("bad", `Stop: ${reason}`, this.who(client), this.when(time));
    this.log.urgent(`Stop: ${reason}`);
  }

  private requested(request: ControlRequest, time: number): void {
    const what = describeRequest(
      request,
      this.robot.arms.map(({ name }) => name),
    );
    const repeats = request.kind === ControlKind.jog || request.kind === ControlKind.hold;
    if (what === "" || (repeats && !this.fresh(`${what} ${request.client}`, time))) return;
    this.note(request.client, request.request, what, time);
  }
  /** A request of another client; its reply follows. */
  private note(client: bigint, request: bigint, what: string, time: number): void {
    if (client === this.commander.client) return;
    this.log.add("info", what, this.who(client), this.when(time));
    this.asked.set(`${client} ${request}`, what);
    if (this.asked.size > kRequests) this.asked.delete(this.asked.keys().next().value!);
  }
  /** A reply to any client. */
  replied({ client, request, accepted, reason }: Reply): void {
    const what = this.asked.get(`${client} ${request}`);
    if (what !== undefined && accepted === 0) this.log.add("bad", `${what} refused: ${reason}`, this.who(client));
    this.asked.delete(`${client} ${request}`);
  }

  /** Requests, refusals and stops are logged with their client already, and states and faults as such: those are announced. */
  private line({ level, name, msg, stamp }: ProcessLine): void {
    if (/^(request refused|stop): /.test(msg)) return;
    const time = this.when(1000 * stamp.sec + 1e-6 * stamp.nsec);
    this.log.add(level >= kWarning ? "bad" : "info", msg, name, time, false);
  }

  /** Of control. After an interruption of the link, changes since the last one are noted. */
  received(status: ControlStatus, time: number): void {
    const arms = this.robot.arms.map(({ name }) => name);
    const nothing = { ...status, faults: new Uint32Array(8) };
    for (const [level, text] of changesOf(this.status ?? nothing, status, arms))
      this.log.add(level, text, "robot", this.when(time));
    if (this.status && this.status.lease_owner !== status.lease_owner) {
      const owner = status.lease_owner;
      this.log.add(
        "info",
        owner === 0n ? "Control is free" : `${this.who(owner)} has control`,
        "robot",
        this.when(time),
      );
    }
    this.status = status;
  }
  /** A service has said why it ends. */
  ended({ status }: DiagnosticArray, time: number): void {
    for (const { name, message } of status)
      if (message.startsWith("ended: ")) this.log.add("alarm", message, name, this.when(time));
  }
  receivedHal({ emergency_stop }: HalStatus, time: number): void {
    const pressed = emergency_stop === EmergencyStop.pressed;
    if (pressed !== this.pressed)
      this.log.add(
        pressed ? "alarm" : "info",
        `Emergency stop ${pressed ? "pressed" : "released"}`,
        "robot",
        this.when(time),
      );
    this.pressed = pressed;
  }
  /** Of the last run: at once, and again after each connection. */
  ran(summary: RunSummary, time: number): void {
    const run = `${summary.trajectory_id} ${summary.name} ${summary.duration}`;
    if (run === this.shownRun) return;
    this.shownRun = run;
    const { headline, bad } = describeSummary(
      summary,
      this.robot.arms.map(({ name }) => name),
    );
    const level = summary.phase === Phase.failed ? "alarm" : bad ? "bad" : "done";
    this.log.add(level, headline, "tandem-planning", this.when(time));
  }
}
