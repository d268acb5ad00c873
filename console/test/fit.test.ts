// SPDX-License-Identifier: Apache-2.0
import * as THREE from "three";
import { expect, test } from "vitest";

import type { Extent, Insets } from "../src/scene/fit";
import { fit } from "../src/scene/fit";
import { seeded } from "./random";

const kFov = 40; // deg

test("the camera sees each extent whole between the insets, and is as near as that allows", () => {
  const random = seeded();
  const between = (least: number, most: number): number => least + (most - least) * random();
  const vector = (size: number): THREE.Vector3 =>
    new THREE.Vector3(between(-size, size), between(-size, size), between(-size, size));
  for (let run = 0; run < 300; ++run) {
    const extents: Extent[] = Array.from({ length: 1 + Math.floor(8 * random()) }, () => ({
      at: vector(0.3),
      radius: between(0.001, 0.02),
    }));
    const insets: Insets = {
      left: between(0, 0.3),
      right: between(0, 0.3),
      top: between(0, 0.3),
      bottom: between(0, 0.3),
    };
    const aspect = between(0.4, 3);
    const direction = vector(1);
    const up = new THREE.Vector3(1, 0, 0);
    const { position, target } = fit(extents, direction, up, (kFov * Math.PI) / 180, aspect, insets);
    const camera = new THREE.PerspectiveCamera(kFov, aspect, 1e-4, 100);
    camera.up.copy(up);
    camera.position.copy(position);
    camera.lookAt(target);
    camera.updateMatrixWorld();
    expect(position.clone().sub(target).normalize().distanceTo(direction.clone().normalize())).toBeLessThan(1e-6);
    // Distances of each sphere to the planes through the camera and the edges of the allowed part of the picture.
    const slope = Math.tan((0.5 * kFov * Math.PI) / 180);
    const gaps = extents.map(({ at, radius }) => {
      const { x, y, z } = at.clone().applyMatrix4(camera.matrixWorldInverse);
      const gap = (to: number, scale: number, inset: number): number => {
        const a = scale * (1 - 2 * inset);
        return (a * -z - to) / Math.hypot(1, a) - radius;
      };
      return {
        right: gap(x, slope * aspect, insets.right),
        left: gap(-x, slope * aspect, insets.left),
        top: gap(y, slope, insets.top),
        bottom: gap(-y, slope, insets.bottom),
      };
    });
    const least = (side: keyof (typeof gaps)[number]): number => Math.min(...gaps.map((gap) => gap[side]));
    for (const side of ["right", "left", "top", "bottom"] as const) expect(least(side)).toBeGreaterThan(-1e-9);
    const width = Math.max(least("right"), least("left"));
    const height = Math.max(least("top"), least("bottom"));
    expect(Math.min(width, height)).toBeLessThan(1e-9); // two opposite edges are touched
  }
});
