// SPDX-License-Identifier: Apache-2.0
/** All received data by topic, with its age. */
import type { Slot, Source } from "../wire/link";
import type {
  ActuationLimits,
  Clearances,
  ControlPermissions,
  ControlStatus,
  DiagnosticArray,
  HalStatus,
  JointState,
  Path,
  PlanningReference,
  PoseStamped,
  RunSummary,
  Shape,
  Stop,
} from "../wire/messages";
import { age, ageText, staleAfter } from "./age";
import type { Robot } from "./robot";
import { Phase } from "../wire/messages";
import type { ServerClock } from "./server";
import { Services } from "./services";
import { stateName, whyNot } from "./descriptions";
import { type Followed, followed } from "./taskerrors";

export interface ArmSlots {
  measuredJs: Slot;
  setpointJs: Slot;
  measuredCp: Slot;
  shape: Slot;
}

/** @param time  when the server received it, by its clock, ms since 1970 */
export type Listener<T> = (message: T, time: number) => void;

/** Listeners that receive every sample, in order. */
export interface Taps {
  status: Listener<ControlStatus>[];
  shape: Listener<number>[];
  hal: Listener<HalStatus>[];
  summary: Listener<RunSummary>[];
  diagnostics: Listener<DiagnosticArray>[];
  stop: Listener<Stop>[];
  clearance: Listener<Clearances>[];
}

// Samples per second. Input of teleoperation names the last status, whose age counts against its budget; counters of the drives are read.
const kStatusRate = 60;
const kDrivesRate = 10;

const kParameter = "parameter "; // runtime::kParameterKey
const kTrajectory = "trajectory "; // runtime::kTrajectoryKey

export class World {
  readonly status: Slot;
  readonly permissions: Slot;
  readonly hal: Slot;
  readonly limits: Slot;
  readonly reference: Slot;
  readonly path: Slot;
  readonly summary: Slot;
  readonly clearance: Slot;
  readonly teleop: Slot;
  readonly arms: ArmSlots[];
  /** Present values of the method's parameters, as control reports them once a second. */
  readonly parameters = new Map<string, string>();
  /** Name of the last trajectory, and its id, as planning reports them once a second. */
  private trajectory = { id: 0, name: "" };
  readonly services = new Services();
  readonly taps: Taps = { status: [], shape: [], hal: [], summary: [], diagnostics: [], stop: [], clearance: [] };

  constructor(
    readonly robot: Robot,
    readonly link: Source,
    readonly server: Pick<ServerClock, "age">,
  ) {
    const topic = (name: string): string => `/${robot.prefix}/${name}`;
    this.status = link.subscribe<ControlStatus>(
      topic("control/status"),
      (m, time) => this.taps.status.forEach((f) => f(m, time)),
      kStatusRate,
    );
    this.permissions = link.subscribe(topic("control/permissions"));
    this.hal = link.subscribe<HalStatus>(
      topic("hal/status"),
      (m, time) => this.taps.hal.forEach((f) => f(m, time)),
      kDrivesRate,
    );
    this.limits = link.subscribe(topic("actuation/limits"));
    this.reference = link.subscribe(topic("planning/reference"));
    this.path = link.subscribe(topic("planning/path"));
    this.summary = link.subscribe<RunSummary>(topic("planning/summary"), (m, time) =>
      this.taps.summary.forEach((f) => f(m, time)),
    );
    this.clearance = link.subscribe<Clearances>(topic("control/clearance"), (m, time) =>
      this.taps.clearance.forEach((f) => f(m, time)),
    );
    this.teleop = link.subscribe(topic("teleop/status"));
    link.subscribe<Stop>(topic("stop"), (m, time) => {
      this.services.stopped(m.reason, performance.now());
      this.taps.stop.forEach((f) => f(m, time));
    });
    link.subscribe<DiagnosticArray>(topic("diagnostics"), (m, time) => {
      this.services.received(m, performance.now());
      this.note(m);
      this.taps.diagnostics.forEach((f) => f(m, time));
    });
    this.arms = robot.arms.map((arm, k) => ({
      measuredJs: link.subscribe(topic(`${arm.name}/measured_js`)),
      setpointJs: link.subscribe(topic(`${arm.name}/setpoint_js`)),
      measuredCp: link.subscribe(topic(`${arm.name}/measured_cp`)),
      shape: link.subscribe<Shape>(topic(`${arm.name}/shape`), (_, time) => this.taps.shape.forEach((f) => f(k, time))),
    }));
  }

  private note({ status }: DiagnosticArray): void {
    for (const { values } of status) {
      for (const { key, value } of values) {
        if (key.startsWith(kParameter)) this.parameters.set(key.slice(kParameter.length), value);
        if (key.startsWith(kTrajectory)) this.trajectory = { id: Number(key.slice(kTrajectory.length)), name: value };
      }
    }
  }

  controlStatus = (): ControlStatus | null => this.status.value();
  /** Reason why control would refuse an action of the lease owner now. @param arm  -1: with any arm */
  whyNot = (action: number, arm = -1): string =>
    whyNot(
      this.permissions.value<ControlPermissions>(),
      action,
      this.robot.arms.map(({ name }) => name),
      arm,
      this.states(),
    );
  halStatus = (): HalStatus | null => this.hal.value();
  moving = (): ActuationLimits | null => this.limits.value();
  plan = (): PlanningReference | null => this.reference.value();
  /** What control follows: a trajectory, or an operator. */
  followed = (status: ControlStatus): Followed | null =>
    followed(status, this.plan(), this.teleop.value(), this.robot.teleoperation.orientation);
  planned = (): Path | null => this.path.value();
  /** Name of the planned trajectory; empty until planning has reported it. */
  trajectoryName = (): string => (this.trajectory.id === this.plan()?.trajectory_id ? this.trajectory.name : "");
  /** What follows when the arms, or a trajectory, are resumed. */
  continues(): string {
    const plan = this.plan();
    const goes = plan !== null && (plan.phase === Phase.running || plan.phase === Phase.paused);
    return goes
      ? `continues ${this.trajectoryName() || "the trajectory"} from point ${plan.point} of ${plan.point_count}`
      : "nothing moves by itself";
  }
  /** How old the last reference of planning is, in words, if planning no longer publishes; empty if it does. It repeats
   * its reference every 50 ms, whatever the robot does. */
  planningSilent(now: number): string {
    return this.stale(this.reference, now) ? ageText(this.age(this.reference, now)) : "";
  }
  /** Operating states of all arms; empty while they are not known. */
  states(): string[] {
    const status = this.controlStatus();
    return status === null ? [] : [...status.operating_state.slice(0, status.arm_count)].map(stateName);
  }
  paused = (): boolean => this.states().includes("PAUSED");
  /** Whether an arm has a motion to complete. */
  busy(): boolean {
    const status = this.controlStatus();
    return status !== null && status.busy.slice(0, status.arm_count).some((busy) => busy !== 0);
  }
  /** Whether control has published a status after the one that a reply names. */
  after = (sequence: number): boolean => Number(this.controlStatus()?.sequence ?? 0n) > sequence;
  /** Of the last run. */
  lastRun = (): RunSummary | null => this.summary.value();
  clearances = (): Clearances | null => this.clearance.value();
  joints = (arm: number): JointState | null => this.arms[arm]?.measuredJs.value() ?? null;
  setpoints = (arm: number): JointState | null => this.arms[arm]?.setpointJs.value() ?? null;
  tip = (arm: number): PoseStamped | null => this.arms[arm]?.measuredCp.value() ?? null;
  shape = (arm: number): Shape | null => this.arms[arm]?.shape.value() ?? null;

  /** Whether control and drives publish at present, so that the display is current and commands make sense. */
  live(now: number): boolean {
    return this.link.state === "open" && !this.stale(this.status, now) && !this.stale(this.hal, now);
  }
  /** ms since the server received the last sample, at most; infinite if none came, or while the clocks are not compared. */
  age(slot: Slot, now: number): number {
    return slot.at < 0 ? Infinity : this.server.age(slot.time, now);
  }
  stale(slot: Slot, now: number): boolean {
    return this.age(slot, now) > this.late;
  }
  /** Whether messages of control come, but are old: the link holds them back, or the clocks are not compared yet. */
  heldBack(now: number): boolean {
    return this.stale(this.status, now) && age(this.status.at, now) <= this.late;
  }
  /** Age at which data is stale, ms. */
  get late(): number {
    return staleAfter(Math.max(this.robot.control.period, this.robot.status_period));
  }
}
