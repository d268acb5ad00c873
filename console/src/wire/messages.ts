// SPDX-License-Identifier: Apache-2.0
/** The members of messages that the page looks at. idl/ has all of them, with their units. */

export const kJointsPerArm = 8;
export const kAllArms = 255;
export const kPort = 255;
export const kMethods = ["nsp", "nspwln", "nspwln-joint", "nspqp", "snsqp", "sns", "hqp"];
export const kPhases = ["idle", "running", "paused", "finished", "failed"];
export const Phase = { idle: 0, running: 1, paused: 2, finished: 3, failed: 4 };
export const State = { disabled: 0, enabled: 1, paused: 2, fault: 3 };
export const TaskKind = { none: 0, relative: 1, tip: 2, frame: 3 };
export const ControlKind = {
  acquireLease: 1,
  releaseLease: 2,
  keepLease: 3,
  stateCommand: 4,
  setMethod: 5,
  setParameter: 6,
  moveJp: 7,
  jog: 8,
  home: 9,
  hold: 10,
};
export const PlanningKind = { start: 1, pause: 2, resume: 3, stop: 4 };

export interface ControlStatus {
  session: bigint;
  sequence: bigint;
  stamp: bigint;
  method: number;
  bounds: number;
  solve_status: number;
  arm_count: number;
  operating_state: Uint8Array;
  homed: Uint8Array;
  recovery: Uint8Array;
  busy: Uint8Array;
  faults: Uint32Array;
  lease_holder: bigint;
  task_count: number;
  task_error: Float64Array;
  task_scale: Float64Array;
  iterations: number;
  solve_time: number;
  cycle_time: number;
  cycle_time_max: number;
  period: number;
  jitter_max: number;
  cycles: bigint;
  overruns: bigint;
  model: number;
  feedback: number;
  hold: number;
  tip_age: number;
  snaps: Uint32Array;
  limited: number;
  limit_count: number;
  limit_kind: Uint8Array;
  limit_arm: Uint8Array;
  limit_tube: Uint8Array;
  idle: Float64Array;
  idle_left: Float64Array;
}

export interface HalStatus {
  arm_count: number;
  operating_state: Uint8Array;
  faults: Uint32Array;
  first_fault: Uint32Array;
  fault_cause: Uint8Array;
  fault_joint: Uint8Array;
  fault_amount: Float64Array;
  fault_allowed: Float64Array;
  guard_count: BigUint64Array;
  guard_largest: Float64Array;
  homed: Uint8Array;
  emergency_stop: number;
  bus_count: number;
  bus_load: number;
}

export interface ActuationLimits {
  arm_count: number;
  joint_count: Uint8Array;
  lower: Float64Array;
  upper: Float64Array;
  velocity_lower: Float64Array;
  velocity_upper: Float64Array;
  active: Uint8Array;
}

export interface TaskReference {
  kind: number;
  arm: number;
  other_arm: number;
  position: Float64Array;
}

export interface PlanningReference {
  trajectory_id: number;
  point: number;
  point_count: number;
  iteration: number;
  total_iterations: number;
  phase: number;
  tolerance: number;
  task_count: number;
  tasks: TaskReference[];
}

export interface Vector3 {
  x: number;
  y: number;
  z: number;
}

export interface PoseStamped {
  header: { stamp: { sec: number; nsec: number } };
  pose: { position: Vector3; orientation: Vector3 & { w: number } };
}

export interface Path {
  poses: PoseStamped[];
}

export interface JointState {
  header: { stamp: { sec: number; nsec: number } };
  position: Float64Array;
  velocity: Float64Array;
}

export interface Shape {
  points: Float32Array;
  tubes: Uint8Array;
  outer_radius: Float32Array;
}

export interface BodyClearance {
  arm: number;
  other_arm: number;
  distance: number;
  place: Float64Array;
  other_place: Float64Array;
}

export interface Clearances {
  bodies: BodyClearance[];
}

export interface Reply {
  client: bigint;
  request: bigint;
  accepted: number;
  code: number;
  reason: string;
  value: number;
}

export interface ClockReply {
  client: bigint;
  request: bigint;
  process: string;
}

export interface DiagnosticArray {
  status: { level: number; name: string; message: string }[];
}

export interface TeleopStage {
  name: string;
  active: number;
  limited_by: string;
  output: Float64Array;
}

export interface TeleopStatus {
  state: number;
  reason: string;
  client: bigint;
  scale: number;
  latency: number;
  input_rate: number;
  tip_latency: number;
  refused: bigint;
  late: bigint;
  stages: TeleopStage[];
  wanted: Float64Array;
  target: Float64Array;
  tip_target: Float64Array;
  mode: number;
  arm: number;
  other_arm: number;
  clamped: number;
  limited_by: string;
}

/** TeleopStatus::state */
export const Teleop = { idle: 0, refused: 1, released: 2, clutched: 3, following: 4, stopped: 5 };
