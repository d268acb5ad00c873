// SPDX-License-Identifier: Apache-2.0
import * as THREE from "three";
import { expect, test } from "vitest";

import { objectPose, ObjectView } from "../src/scene/object";
import type { GraspedObject, Pose } from "../src/state/robot";
import type { PoseStamped } from "../src/wire/messages";
import { seeded } from "./random";

const matrix = ({ position, orientation: [x, y, z, w] }: Pose): THREE.Matrix4 =>
  new THREE.Matrix4().compose(
    new THREE.Vector3().fromArray(position),
    new THREE.Quaternion(x, y, z, w),
    new THREE.Vector3(1, 1, 1),
  );
const pose = (from: THREE.Matrix4): Pose => {
  const [position, turn, size] = [new THREE.Vector3(), new THREE.Quaternion(), new THREE.Vector3()];
  from.decompose(position, turn, size);
  return { position: position.toArray(), orientation: turn.toArray() };
};
const apart = (a: Pose, b: Pose): number =>
  Math.max(...matrix(a).elements.map((value, k) => Math.abs(value - matrix(b).elements[k]!)));

function dice(random: () => number): Pose {
  const turn = new THREE.Quaternion(random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5).normalize();
  return { position: [random() - 0.5, random() - 0.5, random() - 0.5], orientation: turn.toArray() };
}
const held = (random: () => number, type: string): GraspedObject => ({
  size: 0.01,
  color: "#7fbf3f",
  contacts: ["arm_a", "arm_b"].map((arm) => ({ arm, type, frame: dice(random), hand: dice(random) })),
});
/** Tips that touch an object at this pose; at contacts that allow rotation, each is turned about its contact point. */
const touching = (object: GraspedObject, at: Pose, turns: THREE.Matrix4[]): Pose[] =>
  object.contacts.map(({ frame, hand }, k) =>
    pose(matrix(at).multiply(matrix(frame)).multiply(turns[k]!).multiply(matrix(hand).invert())),
  );

test("a gripped object is where its tips are", () => {
  const random = seeded();
  for (let round = 0; round < 50; ++round) {
    const object = held(random, "rigid");
    const at = dice(random);
    const none = [new THREE.Matrix4(), new THREE.Matrix4()];
    expect(apart(objectPose(object, touching(object, at, none)), at)).toBeLessThan(1e-9);
  }
});

test("an object between points lies as its points do", () => {
  const random = seeded();
  for (let round = 0; round < 50; ++round) {
    const object = held(random, "point");
    const turns = [0, 1].map(() => matrix({ ...dice(random), position: [0, 0, 0] }));
    const tips = touching(object, dice(random), turns);
    const found = matrix(objectPose(object, tips));
    object.contacts.forEach(({ frame, hand }, k) => {
      const touch = new THREE.Vector3().fromArray(hand.position).applyMatrix4(matrix(tips[k]!));
      const place = new THREE.Vector3().fromArray(frame.position).applyMatrix4(found);
      expect(touch.distanceTo(place)).toBeLessThan(1e-9);
    });
  }
});

test("it is shown once all tips that hold it are known", () => {
  const object = held(seeded(), "rigid");
  const view = new ObjectView(object);
  const stamped = (sec: number): PoseStamped => ({
    header: { frame_id: "", stamp: { sec, nanosec: 0 } },
    pose: { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
  });
  view.update([stamped(1), null]);
  expect(view.mesh.visible).toBe(false);
  view.update([stamped(1), stamped(0)]);
  expect(view.mesh.visible).toBe(false);
  view.update([stamped(1), stamped(2)]);
  expect(view.mesh.visible).toBe(true);
});
