// SPDX-License-Identifier: Apache-2.0
/** Events of the robot and of other clients, for the log: states, faults, stops, runs, requests, lines of the processes. */
import type { Link } from "../wire/link";
import { EmergencyStop, Phase } from "../wire/messages";
import type {
  ControlStatus,
  DiagnosticArray,
  HalStatus,
  Identity,
  Log as ProcessLine,
  RunSummary,
  Stop,
} from "../wire/messages";
import type { Commander } from "./commander";
import { faultsOf, shortName, stateName } from "./descriptions";
import type { Level, Log } from "./log";
import type { Past } from "./past";
import { Recent } from "./recent";
import type { Robot } from "./robot";
import { isEnd } from "./services";
import { describeSummary } from "./summary";

const kCrtkClients = 2n ** 64n - 1n;
const kAgain = 1000; // ms after which a repeated stop is a new one
const kWarning = 30; // rcl_interfaces/Log
const kMostNames = 500; // of processes, and of requests that may be repetitions

/** "client 1f3a": pages have no other name. */
export const clientName = (client: bigint): string =>
  client === kCrtkClients ? "CRTK clients" : `client ${(client & 0xffffn).toString(16).padStart(4, "0")}`;

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
  private readonly names = new Recent<bigint, string>(kMostNames);
  private readonly repeated = new Recent<string, number>(kMostNames);
  private shownRun = "";

  constructor(
    private readonly robot: Robot,
    link: Link,
    private readonly commander: Commander,
    private readonly log: Log,
    /** Time of this page, ms since 1970, for one of the server's clock. */
    private readonly when: (time: number) => number,
    past: Past,
  ) {
    const topic = (name: string): string => `/${robot.prefix}/${name}`;
    const listen = <T>(name: string, handle: (message: T, time: number) => void): void => {
      link.subscribe<T>(name, past.listen(name, handle));
    };
    listen<Identity>(topic("identity"), (m) => {
      this.names.set(m.session, `tandem-${m.process} (pid ${m.pid} on ${m.host})`);
    });
    listen<ProcessLine>("/rosout", (m, time) => this.line(m, time));
    this.requested = past.listen(topic("stop"), (m: Stop, time) => this.stopped(m, time));
    this.received = past.listen(topic("control/status"), (m: ControlStatus, time) => this.controlled(m, time));
    this.receivedHal = past.listen(topic("hal/status"), (m: HalStatus, time) => this.drives(m, time));
    this.ended = past.listen(topic("diagnostics"), (m: DiagnosticArray, time) => this.processes(m, time));
    this.ran = past.listen(topic("planning/summary"), (m: RunSummary, time) => this.run(m, time));
  }
  readonly requested: (stop: Stop, time: number) => void;
  readonly received: (status: ControlStatus, time: number) => void;
  readonly receivedHal: (status: HalStatus, time: number) => void;
  readonly ended: (diagnostics: DiagnosticArray, time: number) => void;
  readonly ran: (summary: RunSummary, time: number) => void;

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
    const said = !this.fresh(`stopped: ${reason}`, time);
    if (client === this.commander.client || !this.fresh(`stop ${client}`, time) || said) return;
    this.log.add("bad", `Stop: ${reason}`, this.who(client), this.when(time));
    this.log.urgent(`Stop: ${reason}`);
  }

  /** Requests of other clients, and their refusals, are lines of control and planning: these have also the request of a process that has just
   * started. States and faults are logged as such already, and announced then; so are stops, but for one that did not reach the server. */
  private line({ level, name, msg, stamp }: ProcessLine, time: number): void {
    const at = this.when(1000 * stamp.sec + 1e-6 * stamp.nanosec);
    const [, what, reason, who] = /^request(?:: (.*)| refused: (.*)), by (.*)$/s.exec(msg) ?? [];
    if (who !== undefined) {
      if (who === clientName(this.commander.client)) return; // its orders are logged with their effects
      if (what !== undefined) this.log.add("info", what, who, at);
      else this.log.add("bad", `refused: ${reason}`, who, at);
    } else if (!msg.startsWith("stop: ")) this.log.add(level >= kWarning ? "bad" : "info", msg, name, at, false);
    else if (this.fresh(`stopped: ${msg.slice(6)}`, time)) {
      this.log.add("bad", `Stop: ${msg.slice(6)}`, name, at);
      this.log.urgent(msg);
    }
  }

  /** Of control. After an interruption of the link, changes since the last one are noted. */
  private controlled(status: ControlStatus, time: number): void {
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
  private processes({ status }: DiagnosticArray, time: number): void {
    for (const { name, message } of status) if (isEnd(message)) this.log.add("alarm", message, name, this.when(time));
  }
  private drives({ emergency_stop }: HalStatus, time: number): void {
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
  private run(summary: RunSummary, time: number): void {
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
