// SPDX-License-Identifier: Apache-2.0
import * as THREE from "three";

import type { Arm } from "../state/robot";

/** A direction of the arm's base frame in the robot's base frame. */
export function baseAxis(arm: Arm, axis: readonly [number, number, number]): number[] {
  const [x = 0, y = 0, z = 0, w = 1] = arm.base.orientation;
  return new THREE.Vector3(...axis).applyQuaternion(new THREE.Quaternion(x, y, z, w)).toArray();
}
