// SPDX-License-Identifier: Apache-2.0
/** Grasped object: a box at its pose between the tips. */
import * as THREE from "three";

import type { GraspedObject, Pose } from "../state/robot";
import type { PoseStamped } from "../wire/messages";

interface Placed {
  position: THREE.Vector3;
  turn: THREE.Quaternion;
}

const placed = ({ position, orientation: [x = 0, y = 0, z = 0, w = 1] }: Pose): Placed => ({
  position: new THREE.Vector3().fromArray(position),
  turn: new THREE.Quaternion(x, y, z, w),
});

/** Robot base frame <- object, as in services/console/grasped_object.cpp: a rigid contact turns it with the tip; with contacts that
 * allow rotation, the line from the first to the second one gives its orientation. @param tips in the order of the contacts */
export function objectPose(
  object: GraspedObject,
  tips: readonly Pose[],
): { position: number[]; orientation: number[] } {
  const places = object.contacts.map(({ frame }) => placed(frame).position);
  const touches = object.contacts.map(({ hand }, k) => {
    const tip = placed(tips[k]!);
    return placed(hand).position.applyQuaternion(tip.turn).add(tip.position);
  });
  const first = object.contacts[0]!;
  const turn = placed(tips[0]!).turn.multiply(placed(first.hand).turn).multiply(placed(first.frame).turn.invert());
  if (places.length > 1 && first.type !== "rigid") {
    const from = places[1]!.clone().sub(places[0]!).applyQuaternion(turn).normalize();
    const to = touches[1]!.clone().sub(touches[0]!).normalize();
    turn.premultiply(new THREE.Quaternion().setFromUnitVectors(from, to));
  }
  const middle = new THREE.Vector3();
  touches.forEach((touch, k) => {
    middle.addScaledVector(touch.clone().sub(places[k]!.clone().applyQuaternion(turn)), 1 / touches.length);
  });
  return { position: middle.toArray(), orientation: turn.toArray() };
}

/** A pose is known once it has a stamp. */
export const known = ({ header }: PoseStamped): boolean => header.stamp.sec !== 0 || header.stamp.nanosec !== 0;

export class ObjectView {
  readonly mesh: THREE.Mesh;

  constructor(private readonly object: GraspedObject) {
    this.mesh = new THREE.Mesh(
      new THREE.BoxGeometry(object.size, object.size, object.size),
      new THREE.MeshStandardMaterial({ color: object.color, roughness: 0.6, transparent: true, opacity: 0.65 }),
    );
    this.mesh.visible = false;
  }

  /** @param tips of the arms, in the order of the contacts */
  update(tips: readonly (PoseStamped | null)[]): void {
    const poses = tips.slice(0, this.object.contacts.length).flatMap((tip): Pose[] => {
      if (!tip || !known(tip)) return [];
      const { position: p, orientation: o } = tip.pose;
      return [{ position: [p.x, p.y, p.z], orientation: [o.x, o.y, o.z, o.w] }];
    });
    if (poses.length < this.object.contacts.length) return;
    const { position, orientation } = objectPose(this.object, poses);
    this.mesh.position.fromArray(position);
    this.mesh.quaternion.fromArray(orientation);
    this.mesh.visible = true;
  }
}
