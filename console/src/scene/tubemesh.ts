// SPDX-License-Identifier: Apache-2.0
/** The swept tubes of one arm, rewritten in place with each shape. */
import * as THREE from "three";

import type { Arm } from "../state/robot";
import { baseAxis } from "./base";
import type { Closest } from "./closeness";
import { closeness } from "./closeness";
import { kClose } from "./colors";
import type { Backbone } from "./sweep";
import { computeFrames, makeFrames, makeMesh, sweep } from "./sweep";

const kMostPoints = 256;
const kMostRings = kMostPoints + 8;
const kSides = 20;
const kCloseColor = new THREE.Color(kClose).toArray();

export class TubeMesh {
  readonly object: THREE.Mesh;
  private readonly mesh = makeMesh(kMostRings, kSides);
  private readonly frames = makeFrames(kMostPoints);
  private readonly geometry = new THREE.BufferGeometry();
  private readonly material = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.45, metalness: 0.15 });
  private readonly colors: number[][];
  private readonly zero: number[];

  constructor(arm: Arm) {
    const attribute = (values: Float32Array): THREE.BufferAttribute =>
      new THREE.BufferAttribute(values, 3).setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute("position", attribute(this.mesh.position));
    this.geometry.setAttribute("normal", attribute(this.mesh.normal));
    this.geometry.setAttribute("color", attribute(this.mesh.color));
    this.geometry.setIndex(new THREE.BufferAttribute(this.mesh.index, 1));
    this.geometry.setDrawRange(0, 0);
    this.object = new THREE.Mesh(this.geometry, this.material);
    this.object.frustumCulled = false; // its bounds change with every sample
    this.colors = arm.tubes.map(({ color }) => new THREE.Color(color).toArray());
    this.zero = baseAxis(arm, [1, 0, 0]);
  }

  /** @param angles  of the tubes' stripes, rad @param thickness  factor on the drawn radius @param closest  points that get the colour of
   * a small clearance */
  update(shape: Backbone, angles: ArrayLike<number>, thickness: number, closest: readonly Closest[]): void {
    const count = Math.min(shape.tubes.length, kMostPoints);
    if (count < 2) return;
    computeFrames(shape.points, count, this.zero, this.frames);
    const backbone = { points: shape.points, tubes: shape.tubes.subarray(0, count), radius: shape.radius };
    const tint = { color: kCloseColor, share: (at: number): number => closeness(shape.points, at, closest) };
    const look = { colors: this.colors, angles, stripe: 0.34, ...(closest.length > 0 ? { tint } : {}) };
    sweep(backbone, this.frames, look, thickness, kSides, this.mesh);
    for (const name of ["position", "normal", "color"]) this.geometry.getAttribute(name).needsUpdate = true;
    this.geometry.setDrawRange(0, this.mesh.drawn);
  }

  /** 1: solid. @returns whether that has changed. */
  setOpacity(opacity: number): boolean {
    if (this.material.opacity === opacity) return false;
    this.material.transparent = opacity < 1;
    this.material.opacity = opacity;
    this.material.needsUpdate = true;
    return true;
  }
}
