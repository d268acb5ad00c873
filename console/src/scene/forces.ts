// SPDX-License-Identifier: Apache-2.0
/** Arrows of the contact forces on the tips. */
import * as THREE from "three";

import type { Arm } from "../state/robot";
import { arrowUnit } from "../state/force";

/** Length of the arrow that is as strong as the unit, m. */
export const kUnit = 0.02;
const [kHead, kHeadWidth] = [0.006, 0.004]; // m

export class ForcesView {
  readonly group = new THREE.Group();
  /** N per kUnit; 0: no force was known yet */
  unit = 0;
  private readonly arrows: THREE.ArrowHelper[];

  constructor(arms: readonly Arm[]) {
    this.arrows = arms.map((arm) => {
      const arrow = new THREE.ArrowHelper(undefined, undefined, kUnit, arm.color, kHead, kHeadWidth);
      for (const part of [arrow.line, arrow.cone]) {
        (part.material as THREE.Material).depthTest = false; // it begins inside the grasped object
        part.renderOrder = 8;
      }
      arrow.visible = false;
      return arrow;
    });
    this.group.add(...this.arrows);
  }

  /** @param tips  m @param forces  on the tips, N; null: not known */
  update(tips: readonly THREE.Vector3[], forces: readonly (readonly number[] | null)[]): void {
    const vectors = forces.map((force) => (force ? new THREE.Vector3().fromArray(force) : null));
    this.unit = arrowUnit(Math.max(0, ...vectors.map((force) => force?.length() ?? 0)), this.unit);
    vectors.forEach((force, k) => {
      const arrow = this.arrows[k]!;
      const length = force && this.unit > 0 ? (kUnit * force.length()) / this.unit : 0;
      arrow.visible = length > 1e-3;
      if (!arrow.visible) return;
      arrow.position.copy(tips[k]!);
      arrow.setDirection(force!.clone().normalize());
      arrow.setLength(length, Math.min(kHead, 0.5 * length), kHeadWidth);
    });
  }
}
