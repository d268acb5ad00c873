// SPDX-License-Identifier: Apache-2.0
/** Transfers received samples that have changed into the scene. */
import * as THREE from "three";

import type { Context } from "../panels/context";
import type { TeleopStatus } from "../wire/messages";
import { TeleopState } from "../wire/messages";
import { forceOf } from "../state/force";
import { turnOf } from "../state/turning";
import type { Slot } from "../wire/link";
import { closestOf } from "./closeness";
import { known } from "./object";
import type { View } from "./view";

/** Default factor on the drawn radius of tubes: at true scale they are too thin to see. */
export const kThickness = 2;

export class Drawing {
  private readonly seen = new Map<Slot, number>();
  private thickness = kThickness;
  private again = false;

  constructor(
    private readonly c: Context,
    private readonly view: View,
  ) {}

  setThickness(times: number): void {
    this.thickness = times;
    this.again = true;
  }

  /** What is drawn comes from elsewhere, or from another time: the trails do not lead here. */
  restart(): void {
    this.seen.clear();
    this.view.arms.forEach((arm) => arm.clearTrail());
    this.view.guides.setPath({ poses: [] });
    this.view.guides.setClearances(null);
    this.again = true;
  }

  private news(slot: Slot): boolean {
    if (slot.at < 0 || this.seen.get(slot) === slot.count) return false;
    this.seen.set(slot, slot.count);
    return true;
  }

  update(now: number): void {
    const { world } = this.c;
    let changed = this.again;
    let moved = false;
    if (this.news(world.clearance)) {
      this.view.guides.setClearances(world.clearances());
      changed = true; // the tubes show it with their next shape
    }
    this.view.arms.forEach((arm, k) => {
      const slots = world.arms[k]!;
      if (this.news(slots.shape) || this.again) {
        const shape = world.shape(k);
        if (shape) arm.update(shape, world.joints(k), this.thickness, closestOf(k, world.clearances()));
        changed = true;
      }
      const first = !arm.hasTip;
      const tip = this.news(slots.measuredCp) ? world.tip(k) : null;
      moved ||= tip !== null;
      if (tip && known(tip)) {
        arm.moveTip(tip);
        changed = true;
        if (first && this.view.arms.every((other) => other.hasTip)) this.view.look("home");
      }
      changed = arm.setStale(world.stale(slots.shape, now)) || changed;
    });
    this.again = false;
    if (moved && this.c.robot.capabilities.common_path)
      this.view.forces.update(
        this.view.arms.map(({ tip }) => tip),
        this.view.arms.map((_, k) => forceOf(world.shape(k))),
      );
    if (moved) this.view.object?.update(this.view.arms.map((_, k) => world.tip(k)));
    if (this.news(world.path)) {
      const path = world.planned();
      if (path) this.view.guides.setPath(path);
      changed = true;
    }
    const goals = this.news(world.reference) || this.news(world.teleop);
    if (goals) {
      this.showGoals();
      changed = true;
    }
    if (changed) this.view.touch();
  }

  /** Goals of a trajectory, or of teleoperation. */
  private showGoals(): void {
    const { world } = this.c;
    const teleop = world.teleop.value<TeleopStatus>();
    const driven = teleop !== null && (teleop.state === TeleopState.following || teleop.state === TeleopState.clutched);
    const plan = world.plan();
    const tips = this.view.arms.map((arm) => (arm.hasTip ? arm.tip : null));
    const turn = turnOf(teleop);
    this.view.commanded.show(turn, turn && tips[turn.arm] ? this.view.arms[turn.arm]?.place : undefined);
    if (driven) {
      const goals = this.view.arms.map((_, k) => [...teleop.tip_target.slice(3 * k, 3 * k + 3)]);
      const ghost = teleop.clamped ? this.ghost(teleop, goals) : null;
      this.view.guides.setHand(goals, tips, teleop.arm, teleop.other_arm, ghost);
    } else {
      if (plan) this.view.guides.setReference(plan, tips);
      this.view.guides.hideGhost();
    }
  }

  /** Target of the driven tip without limits. */
  private ghost(teleop: TeleopStatus, goals: number[][]): THREE.Vector3 {
    const goal = goals[teleop.arm]!;
    return new THREE.Vector3(
      ...([0, 1, 2].map((k) => goal[k]! + teleop.wanted[k]! - teleop.target[k]!) as [number, number, number]),
    );
  }
}
