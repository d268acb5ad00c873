// SPDX-License-Identifier: Apache-2.0
/** Publishes the operator's input to teleop/input 60 times a second, with a sequence and the echo of
 * control's last status. Control does the rest: dead band, clutch, scale, filter, fixtures, limits. */
import type { Commander } from "../state/commander";
import type { Robot } from "../state/robot";
import type { World } from "../state/world";
import type { Link } from "../wire/link";
import type { TeleopStatus } from "../wire/messages";
import { TeleopState } from "../wire/messages";
import { InputGate } from "./gate";
import type { Quaternion, Vector } from "./motion";
import { hung, kGap } from "./repeats";

export const Mode = { tip: 1, pair: 2, relative: 3 };
export const Device = { gamepad: 1, keyboard: 3, pointer: 5 };
const kVelocity = 1;
const kPose = 2;
const kPeriod = 16; // ms
const kBaseFrame = 0;
const kViewFrame = 1;

export interface Choice {
  mode: number;
  arm: number;
  otherArm: number;
  /** 0.05 to 1. */
  scale: number;
}

const kNone: Vector = [0, 0, 0];
const kUpright: Quaternion = [0, 0, 0, 1];

/** Sample of a device: velocities in the axes of the view, m/s and rad/s, or a place in the robot's base frame. */
export type Reading =
  | { device: number; velocity: Vector; angular?: Vector; buttons?: number }
  | { device: number; position: Vector; orientation?: Quaternion };

export class Pilot {
  readonly gate: InputGate;
  readonly choice: Choice;
  clutch = false;
  /** Rotations are offered, and sent. */
  turns = false;
  sent = 0;
  private ticked = 0;
  private sequence = 0n;
  /** Sequence of the first input of the present hold. */
  private heldFrom = 0n;
  private timer: ReturnType<typeof setInterval> | undefined;
  private lastReading: Reading = { device: Device.keyboard, velocity: kNone };
  /** Reads the device that holds the gate. */
  read: (source: string) => Reading = () => this.lastReading;
  /** Rotation from the view's axes to the base frame's, x y z w. */
  view: () => number[] = () => [0, 0, 0, 1];

  constructor(
    private readonly robot: Robot,
    private readonly world: World,
    private readonly link: Link,
    private readonly commander: Commander,
    changed: (held: boolean) => void,
  ) {
    const two = robot.arms.length > 1;
    this.choice = { mode: two ? Mode.pair : Mode.tip, arm: 0, otherArm: two ? 1 : 0, scale: 0.5 };
    this.gate = new InputGate((held) => {
      if (held) this.heldFrom = this.sequence + 1n;
      else this.send(); // a release is sent at once, not with the next period
      changed(held);
    });
  }

  get armed(): boolean {
    return this.timer !== undefined;
  }
  arm(on: boolean): void {
    if (on === this.armed) return;
    this.gate.allow("armed", on); // sends the end of holding before it stops sending
    if (on) {
      this.ticked = performance.now();
      this.timer = setInterval(() => this.tick(), kPeriod);
    } else {
      this.send();
      clearInterval(this.timer);
      this.timer = undefined;
    }
  }

  private tick(): void {
    const now = performance.now();
    if (now - this.ticked > kGap) this.gate.release(hung(now - this.ticked));
    this.ticked = now;
    this.endWhereStopped();
    this.send();
  }

  /** A hold that control has stopped ends here, too: it moves nothing until it is released. */
  private endWhereStopped(): void {
    const status = this.world.teleop.value<TeleopStatus>();
    if (!status || status.state !== TeleopState.stopped || status.client !== this.commander.client) return;
    if (status.answers_input >= this.heldFrom) this.gate.release(`control has stopped: ${status.reason}`);
  }

  private send(): void {
    const status = this.world.controlStatus();
    if (!status || this.link.state !== "open") return;
    const source = this.gate.source;
    if (source !== null) this.lastReading = this.read(source);
    const held = this.gate.held; // reading may have found the device disconnected
    const reading = this.lastReading;
    const place = "position" in reading ? reading : null;
    const rates = held && "velocity" in reading ? reading : null;
    this.sequence += 1n;
    const message = {
      client: this.commander.client,
      sequence: this.sequence,
      control_session: status.session,
      answers_control: status.sequence,
      stamp: BigInt(Math.round(performance.now() * 1e6)),
      device: reading.device,
      operator_present: held ? 1 : 0,
      clutch: this.clutch ? 1 : 0,
      mode: this.choice.mode,
      arm: this.choice.arm,
      other_arm: this.choice.otherArm,
      kind: place ? kPose : kVelocity,
      frame: place ? kBaseFrame : kViewFrame,
      view: place ? kUpright : this.view(),
      linear: rates?.velocity ?? kNone,
      angular: (this.turns && rates?.angular) || kNone,
      position: place?.position ?? kNone,
      orientation: (this.turns && place?.orientation) || kUpright,
      scale: this.choice.scale,
      buttons: "buttons" in reading ? (reading.buttons ?? 0) : 0,
    };
    if (this.link.publish(`/${this.robot.prefix}/teleop/input`, message)) this.sent += 1;
  }
}
