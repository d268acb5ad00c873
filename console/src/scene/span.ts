// SPDX-License-Identifier: Apache-2.0
/** Where the tip of an arm gets when one joint moves alone through the range that it has now. */
import * as THREE from "three";

import { kReached } from "./colors";

const kEnd = 1.5e-3; // m: radius of the marks at the ends

/** Ends of the segments between neighbouring places of the tip; a gap where it has none. */
export const segmentsOf = (tips: readonly (readonly number[] | null)[]): number[] =>
  tips.slice(1).flatMap((to, k) => {
    const from = tips[k];
    return from && to ? [...from, ...to] : [];
  });

export class SpanView {
  readonly group = new THREE.Group();
  private readonly line: THREE.LineSegments;
  private readonly ends: THREE.Mesh[];

  constructor() {
    this.line = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: kReached }));
    this.line.frustumCulled = false;
    this.ends = [0, 1].map(
      () => new THREE.Mesh(new THREE.SphereGeometry(kEnd, 12, 8), new THREE.MeshBasicMaterial({ color: kReached })),
    );
    this.group.add(this.line, ...this.ends);
    this.group.visible = false;
  }

  /** @param tips  m, at evenly spaced places of the joint, null where the arm has none; none: shows nothing */
  show(tips: readonly (readonly number[] | null)[]): void {
    this.group.visible = tips.length > 0;
    this.line.geometry.dispose();
    this.line.geometry = new THREE.BufferGeometry();
    this.line.geometry.setAttribute("position", new THREE.Float32BufferAttribute(segmentsOf(tips), 3));
    [tips[0], tips[tips.length - 1]].forEach((end, k) => {
      this.ends[k]!.visible = end != null;
      if (end) this.ends[k]!.position.fromArray(end);
    });
  }
}
