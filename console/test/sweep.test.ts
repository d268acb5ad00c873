// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { computeFrames, makeFrames, makeMesh, sweep } from "../src/scene/sweep";
import { seeded } from "./random";

type Vector = [number, number, number];
const at = (a: Float32Array, i: number): Vector => [a[3 * i]!, a[3 * i + 1]!, a[3 * i + 2]!];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** A smooth curve with bends in all directions. */
function curve(random: () => number, count: number): Float32Array {
  const phase = [random(), random(), random()].map((x) => 6 * x);
  const bend = [random(), random()].map((x) => 0.02 + 0.03 * x);
  const points = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) {
    const s = i / (count - 1);
    points.set([bend[0]! * Math.sin(5 * s + phase[0]!), bend[1]! * Math.cos(4 * s + phase[1]!), 0.2 * s], 3 * i);
  }
  return points;
}

test("frames are right-handed, of unit length, and across the tube", () => {
  const random = seeded();
  let worst = 0;
  for (let run = 0; run < 200; ++run) {
    const count = 2 + Math.floor(80 * random());
    const points = curve(random, count);
    const frames = makeFrames(count);
    computeFrames(points, count, [1, 0, 0], frames);
    for (let i = 0; i < count; ++i) {
      const [t, n, b] = [at(frames.tangent, i), at(frames.normal, i), at(frames.binormal, i)];
      worst = Math.max(
        worst,
        Math.abs(dot(t, t) - 1),
        Math.abs(dot(n, n) - 1),
        Math.abs(dot(t, n)),
        Math.abs(dot(cross(t, n), b) - 1),
      );
      if (Number.isNaN(worst)) throw new Error(`run ${run}, point ${i}: not a number`);
    }
  }
  expect(worst).toBeLessThan(1e-4);
});

test("frames do not wind: they turn about the tangent by nothing but rounding from one point to the next", () => {
  const random = seeded();
  let worst = -Infinity;
  for (let run = 0; run < 100; ++run) {
    const points = curve(random, 80);
    const frames = makeFrames(80);
    computeFrames(points, 80, [1, 0, 0], frames);
    for (let i = 0; i + 1 < 80; ++i) {
      // The normal may change along the tangent only: a change along the binormal is winding.
      const turn = dot(minus(at(frames.normal, i + 1), at(frames.normal, i)), at(frames.binormal, i));
      const bend = dot(
        minus(at(frames.tangent, i + 1), at(frames.tangent, i)),
        minus(at(frames.tangent, i + 1), at(frames.tangent, i)),
      );
      worst = Math.max(worst, Math.abs(turn) - bend);
    }
  }
  expect(worst).toBeLessThan(1e-4);
});

test("frames of points upon each other and of a tube along the direction of angle zero are finite", () => {
  const frames = makeFrames(4);
  for (const points of [
    new Float32Array(12),
    new Float32Array([0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0]),
    new Float32Array([0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1]),
  ]) {
    computeFrames(points, 4, [1, 0, 0], frames);
    for (const values of [frames.tangent, frames.normal, frames.binormal])
      expect(values.every(Number.isFinite)).toBe(true);
  }
});

const look = (angles: number[]) => ({
  colors: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  angles,
  stripe: 0.3,
});

test("every corner lies one radius from the backbone, and triangles face outwards", () => {
  const random = seeded();
  const sides = 12;
  let off = 0;
  let inward = 0;
  for (let run = 0; run < 50; ++run) {
    const count = 3 + Math.floor(40 * random());
    const points = curve(random, count);
    const border = Math.floor(count / 2);
    const tubes = Uint8Array.from({ length: count }, (_, i) => (i < border ? 2 : 1));
    const radius = Float32Array.from(tubes, (tube) => 0.0005 * tube);
    const frames = makeFrames(count);
    computeFrames(points, count, [1, 0, 0], frames);
    const mesh = makeMesh(count + 4, sides);
    const rings = sweep({ points, tubes, radius }, frames, look([6 * random(), 6 * random()]), 2, sides, mesh);
    expect(rings).toBe(count + 1); // one more at the change of tubes
    expect(mesh.drawn).toBe(6 * (rings - 1) * sides);
    let ring = 0;
    for (let i = 0; i < count; ++i) {
      for (const like of i + 1 === border ? [i, i + 1] : [i]) {
        for (let j = 0; j <= sides; ++j) {
          const away = minus(at(mesh.position, ring * (sides + 1) + j), at(points, i));
          off = Math.max(off, Math.abs(Math.sqrt(dot(away, away)) - 2 * radius[like]!));
        }
        ring += 1;
      }
    }
    for (let k = 0; k + 2 < mesh.drawn; k += 3) {
      const [a, b, c] = [0, 1, 2].map((n) => at(mesh.position, mesh.index[k + n]!)) as [Vector, Vector, Vector];
      const face = cross(minus(b, a), minus(c, a));
      const normal = at(mesh.normal, mesh.index[k]!);
      if (dot(face, normal) < -1e-9) inward += 1;
    }
  }
  expect(off).toBeLessThan(1e-7);
  expect(inward).toBe(0);
});

test("the stripe turns by what the joint turns by", () => {
  const points = new Float32Array([0, 0, 0, 0, 0, 0.1]);
  const frames = makeFrames(2);
  computeFrames(points, 2, [1, 0, 0], frames);
  const random = seeded();
  for (let run = 0; run < 50; ++run) {
    const angle = 20 * (random() - 0.5);
    const mesh = makeMesh(2, 24);
    sweep(
      { points, tubes: Uint8Array.of(1, 1), radius: Float32Array.of(0.001, 0.001) },
      frames,
      look([angle]),
      1,
      24,
      mesh,
    );
    const marked: Vector = [0, 0, 0];
    for (let j = 0; j < 24; ++j) {
      if (mesh.color[3 * j]! > 0.5) continue; // the tube's own colour is red
      at(mesh.normal, j).forEach((x, k) => (marked[k]! += x));
    }
    const found = Math.atan2(marked[1], marked[0]);
    expect(Math.cos(found - angle)).toBeCloseTo(1, 4);
  }
});

test("more points than there is room for leave the arrays as long as they are", () => {
  const points = curve(seeded(), 100);
  const frames = makeFrames(100);
  computeFrames(points, 100, [1, 0, 0], frames);
  const mesh = makeMesh(10, 8);
  const tubes = new Uint8Array(100).fill(1);
  expect(sweep({ points, tubes, radius: new Float32Array(100).fill(0.001) }, frames, look([0]), 1, 8, mesh)).toBe(10);
  expect(mesh.drawn).toBe(mesh.index.length);
});
