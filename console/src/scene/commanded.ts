// SPDX-License-Identifier: Apache-2.0
/** The orientation that control commands for the driven tip: a frame with a ball at the end of each axis, beside the tip's own frame. */
import * as THREE from "three";

import type { Turn } from "../state/turning";
import { quaternionOf } from "../state/turning";
import { kAxisColors } from "./colors";

const kLength = 0.014; // m, longer than the axes of the tip
const kBall = 0.0009; // m

export class CommandedFrame {
  readonly group = new THREE.Group();

  constructor() {
    kAxisColors.forEach((color, k) => {
      const end = new THREE.Vector3().setComponent(k, kLength);
      const material = { color, depthTest: false, transparent: true }; // visible although it begins inside the tube
      const line = new THREE.Line(
        new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), end]),
        new THREE.LineDashedMaterial({ ...material, dashSize: 0.0015, gapSize: 0.001 }),
      );
      line.computeLineDistances();
      const ball = new THREE.Mesh(new THREE.SphereGeometry(kBall, 12, 8), new THREE.MeshBasicMaterial(material));
      ball.position.copy(end);
      for (const part of [line, ball]) part.renderOrder = 10;
      this.group.add(line, ball);
    });
    this.group.visible = false;
  }

  /** @param turn  null: nobody turns the tip @param tip  its place and orientation */
  show(turn: Turn | null, tip: { position: THREE.Vector3; orientation: THREE.Quaternion } | undefined): void {
    this.group.visible = turn !== null && tip !== undefined;
    if (!turn || !tip) return;
    this.group.position.copy(tip.position);
    this.group.quaternion.set(...quaternionOf(turn.commanded)).multiply(tip.orientation);
  }
}
