// SPDX-License-Identifier: Apache-2.0
import * as THREE from "three";
import { expect, test } from "vitest";

import { closeness, closestOf, kCloseBelow } from "../src/scene/closeness";
import { regionsView, surfaceOf } from "../src/scene/regions";
import { computeFrames, makeFrames, makeMesh, sweep } from "../src/scene/sweep";
import type { Region } from "../src/state/robot";
import type { BodyClearance, Clearances } from "../src/wire/messages";
import { port } from "../src/wire/messages";
import { seeded } from "./random";

const body = (arm: number, other: number, distance: number, place: number[], there: number[]): BodyClearance =>
  ({
    arm,
    other_arm: other,
    distance,
    place: Float64Array.from(place),
    other_place: Float64Array.from(there),
  }) as BodyClearance;

test("each arm has its own closest points, also to the port", () => {
  const clearances = {
    bodies: [body(0, 1, 1e-3, [1, 0, 0], [2, 0, 0]), body(1, port, 2e-3, [3, 0, 0], [3, 0, 0])],
  } as unknown as Clearances;
  const places = (arm: number): number[] => closestOf(arm, clearances).map(({ place }) => place[0]!);
  expect([places(0), places(1), closestOf(0, null)]).toEqual([[1], [2, 3], []]);
});

test("a tube is coloured near its closest points only, and the more the smaller the clearance", () => {
  const random = seeded();
  for (let round = 0; round < 100; ++round) {
    const place = [random(), random(), random()];
    const at = (far: number): number[] => [place[0]! + far, place[1]!, place[2]!];
    const distance = kCloseBelow * (2 * random() - 0.5);
    const share = (far: number, d = distance): number => closeness(at(far), 0, [{ place, distance: d }]);
    expect(share(0)).toBeCloseTo(Math.max(0, Math.min(1, 1 - distance / kCloseBelow)), 9);
    expect(share(0.013)).toBe(0);
    expect(share(0.006)).toBeLessThanOrEqual(share(0.002));
    expect(share(0, distance + 1e-3)).toBeLessThanOrEqual(share(0));
    expect(closeness(at(0), 0, [])).toBe(0);
  }
});

test("the colour of a small clearance is swept over the rings where it is", () => {
  const points = new Float32Array([0, 0, 0, 0, 0, 0.01, 0, 0, 0.02]);
  const frames = makeFrames(3);
  const mesh = makeMesh(3, 4);
  computeFrames(points, 3, [1, 0, 0], frames);
  const backbone = { points, tubes: new Uint8Array([1, 1, 1]), radius: new Float32Array([1, 1, 1]) };
  const tint = { color: [1, 0, 0], share: (at: number): number => (at === 1 ? 1 : 0) };
  sweep(backbone, frames, { colors: [[0, 0, 1]], angles: [0], stripe: 0, tint }, 1, 4, mesh);
  const colors = [0, 1, 2].map((ring) => [...mesh.color.slice(3 * (5 * ring + 2), 3 * (5 * ring + 2) + 3)]);
  expect(colors).toEqual([
    [0, 0, 1],
    [1, 0, 0],
    [0, 0, 1],
  ]);
});

/** Signed distance to a region, as planning/teleoperation/regions.cpp has it. */
function distance(region: Region, p: THREE.Vector3): number {
  if (region.sphere) return p.distanceTo(new THREE.Vector3().fromArray(region.sphere.center)) - region.sphere.radius;
  if (region.half_space) {
    const { point, normal } = region.half_space;
    return p.clone().sub(new THREE.Vector3().fromArray(point)).dot(new THREE.Vector3().fromArray(normal));
  }
  const { min, max } = region.box!;
  return Math.max(...[0, 1, 2].map((k) => Math.max(min[k]! - p.getComponent(k), p.getComponent(k) - max[k]!)));
}

test("the drawn surface of a forbidden region is where the region ends", () => {
  const random = seeded();
  const dice = (): number[] => [0, 1, 2].map(() => random() - 0.5);
  for (let round = 0; round < 50; ++round) {
    const min = dice();
    const normal = new THREE.Vector3().fromArray(dice()).normalize().toArray();
    const regions: Region[] = [
      { name: "vessel", sphere: { center: dice(), radius: 0.1 + random() } },
      { name: "wall", half_space: { point: dice(), normal } },
      { name: "bone", box: { min, max: min.map((x) => x + 0.1 + random()) } },
    ];
    for (const region of regions) {
      const at = surfaceOf(region, new THREE.Vector3().fromArray(dice()), 0.2).getAttribute("position");
      for (let k = 0; k < at.count; ++k)
        expect(Math.abs(distance(region, new THREE.Vector3().fromBufferAttribute(at, k)))).toBeLessThan(1e-6);
    }
    const drawn = regionsView(
      { forbidden: regions, margin: 0, workspace: { min: [0, 0, 0], max: [1, 1, 1] } },
      new THREE.Vector3(),
      1,
    );
    expect(drawn.children.map(({ name }) => name).filter((name) => name !== "")).toEqual(["vessel", "wall", "bone"]);
  }
});
