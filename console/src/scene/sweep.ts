// SPDX-License-Identifier: Apache-2.0
/** Tubes as swept circles along a backbone: positions, normals, colours and indices in preallocated arrays.
 *
 * Rotation-minimising frames carry the circle along (Wang et al., "Computation of rotation minimizing frames",
 * ACM Transactions on Graphics 27, 2008: double reflection), so that a stripe at one angle runs along the tube without
 * winding, and turns on the screen exactly as much as the tube's rotation joint does. */

export interface Frames {
  /** Three numbers per point. */
  tangent: Float32Array;
  /** The direction of angle zero. */
  normal: Float32Array;
  binormal: Float32Array;
}

export const makeFrames = (points: number): Frames => ({
  tangent: new Float32Array(3 * points),
  normal: new Float32Array(3 * points),
  binormal: new Float32Array(3 * points),
});

function direction(p: Float32Array, from: number, to: number, out: Float32Array, at: number, fallback: number): void {
  const x = p[3 * to]! - p[3 * from]!;
  const y = p[3 * to + 1]! - p[3 * from + 1]!;
  const z = p[3 * to + 2]! - p[3 * from + 2]!;
  const length = Math.hypot(x, y, z);
  if (length < 1e-9) {
    // Coincident points have no direction: use the previous one.
    for (let k = 0; k < 3; ++k) out[3 * at + k] = fallback < 0 ? (k === 2 ? 1 : 0) : out[3 * fallback + k]!;
    return;
  }
  out[3 * at] = x / length;
  out[3 * at + 1] = y / length;
  out[3 * at + 2] = z / length;
}

const dot = (a: Float32Array, i: number, x: number, y: number, z: number): number =>
  a[3 * i]! * x + a[3 * i + 1]! * y + a[3 * i + 2]! * z;

/** Frames along `count` points.
 * @param zero direction of angle zero at the first point; its component along the tube is removed. */
export function computeFrames(p: Float32Array, count: number, zero: readonly number[], out: Frames): void {
  const { tangent: t, normal: r, binormal: b } = out;
  for (let i = 0; i < count; ++i) direction(p, Math.max(0, i - 1), Math.min(count - 1, i + 1), t, i, i - 1);
  let along = dot(t, 0, zero[0]!, zero[1]!, zero[2]!);
  let n = zero.map((value, k) => value - along * t[k]!);
  if (Math.hypot(n[0]!, n[1]!, n[2]!) < 1e-6) {
    const other = Math.abs(t[0]!) < 0.9 ? [1, 0, 0] : [0, 1, 0];
    along = dot(t, 0, other[0]!, other[1]!, other[2]!);
    n = other.map((value, k) => value - along * t[k]!);
  }
  const length = Math.hypot(n[0]!, n[1]!, n[2]!);
  for (let k = 0; k < 3; ++k) r[k] = n[k]! / length;
  for (let i = 0; i + 1 < count; ++i) reflect(p, t, r, i);
  for (let i = 0; i < count; ++i) {
    b[3 * i] = t[3 * i + 1]! * r[3 * i + 2]! - t[3 * i + 2]! * r[3 * i + 1]!;
    b[3 * i + 1] = t[3 * i + 2]! * r[3 * i]! - t[3 * i]! * r[3 * i + 2]!;
    b[3 * i + 2] = t[3 * i]! * r[3 * i + 1]! - t[3 * i + 1]! * r[3 * i]!;
  }
}

/** Double reflection from point i to i + 1. */
function reflect(p: Float32Array, t: Float32Array, r: Float32Array, i: number): void {
  const j = i + 1;
  const v = [p[3 * j]! - p[3 * i]!, p[3 * j + 1]! - p[3 * i + 1]!, p[3 * j + 2]! - p[3 * i + 2]!] as const;
  const c = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  const once = (a: Float32Array, at: number): number[] => {
    const s = c > 0 ? (2 / c) * dot(a, at, v[0], v[1], v[2]) : 0;
    return [a[3 * at]! - s * v[0], a[3 * at + 1]! - s * v[1], a[3 * at + 2]! - s * v[2]];
  };
  const mirrored = once(r, i);
  const tangent = once(t, i);
  const w = [t[3 * j]! - tangent[0]!, t[3 * j + 1]! - tangent[1]!, t[3 * j + 2]! - tangent[2]!];
  const d = w[0]! * w[0]! + w[1]! * w[1]! + w[2]! * w[2]!;
  const s = d > 1e-18 ? (2 / d) * (w[0]! * mirrored[0]! + w[1]! * mirrored[1]! + w[2]! * mirrored[2]!) : 0;
  const n = mirrored.map((value, k) => value - s * w[k]!);
  // Rounding errors add up over hundreds of points: keep the normal a unit vector perpendicular to the tube.
  const along = n[0]! * t[3 * j]! + n[1]! * t[3 * j + 1]! + n[2]! * t[3 * j + 2]!;
  for (let k = 0; k < 3; ++k) n[k] = n[k]! - along * t[3 * j + k]!;
  const length = Math.hypot(n[0]!, n[1]!, n[2]!) || 1;
  for (let k = 0; k < 3; ++k) r[3 * j + k] = n[k]! / length;
}

export interface Mesh {
  position: Float32Array;
  normal: Float32Array;
  color: Float32Array;
  index: Uint32Array;
  /** Number of indices in use. */
  drawn: number;
}

/** @param rings maximum number of rings of a sweep, @param sides corners of a ring. */
export function makeMesh(rings: number, sides: number): Mesh {
  const vertices = rings * (sides + 1);
  const index = new Uint32Array(6 * (rings - 1) * sides);
  let k = 0;
  for (let i = 0; i + 1 < rings; ++i) {
    for (let j = 0; j < sides; ++j) {
      const a = i * (sides + 1) + j;
      const c = a + sides + 1;
      index.set([a, a + 1, c, c, a + 1, c + 1], k);
      k += 6;
    }
  }
  const float = (): Float32Array => new Float32Array(3 * vertices);
  return { position: float(), normal: float(), color: float(), index, drawn: 0 };
}

export interface Backbone {
  points: Float32Array;
  tubes: Uint8Array;
  radius: Float32Array;
}

export interface TubeLook {
  /** Red, green, blue from 0 to 1, of tube 1, 2, ... */
  colors: readonly (readonly number[])[];
  /** Angle of each tube's stripe, rad. */
  angles: ArrayLike<number>;
  /** Half the width of the stripe, rad. */
  stripe: number;
  /** A second colour, and its share at each point, 0 to 1. */
  tint?: { color: readonly number[]; share(point: number): number };
}

/** The ring is duplicated where another tube becomes the outermost one, which makes the step and the colours sharp.
 * Rings beyond the capacity are left out. @returns how many rings were written. */
export function sweep(
  from: Backbone,
  frames: Frames,
  look: TubeLook,
  scale: number,
  sides: number,
  mesh: Mesh,
): number {
  const count = Math.min(from.tubes.length, Math.floor(from.points.length / 3), Math.floor(frames.normal.length / 3));
  const capacity = mesh.position.length / 3 / (sides + 1);
  let rings = 0;
  const ring = (i: number, like: number): void => {
    if (rings >= capacity) return;
    writeRing(from, frames, look, scale, sides, mesh, rings++, i, like);
  };
  for (let i = 0; i < count; ++i) {
    ring(i, i);
    if (i + 1 < count && from.tubes[i + 1] !== from.tubes[i]) ring(i, i + 1);
  }
  mesh.drawn = Math.max(0, 6 * (rings - 1) * sides);
  return rings;
}

function writeRing(
  from: Backbone,
  frames: Frames,
  look: TubeLook,
  scale: number,
  sides: number,
  mesh: Mesh,
  ring: number,
  i: number,
  like: number,
): void {
  const tube = Math.max(1, from.tubes[like]!) - 1;
  const color = look.colors[Math.min(tube, look.colors.length - 1)]!;
  const radius = from.radius[like]! * scale;
  const stripe = look.angles[tube] ?? 0;
  const tint = look.tint?.share(i) ?? 0;
  const { normal: r, binormal: b } = frames;
  for (let j = 0; j <= sides; ++j) {
    // Corners are counted from the stripe, so that its edges coincide with corners at every angle.
    const beside = (2 * Math.PI * j) / sides;
    const angle = stripe + beside;
    const c = Math.cos(angle);
    const s = Math.sin(angle);
    const at = 3 * (ring * (sides + 1) + j);
    const marked = Math.min(beside, 2 * Math.PI - beside) <= look.stripe;
    for (let k = 0; k < 3; ++k) {
      const out = c * r[3 * i + k]! + s * b[3 * i + k]!;
      mesh.normal[at + k] = out;
      mesh.position[at + k] = from.points[3 * i + k]! + radius * out;
      mesh.color[at + k] = marked ? 0.06 : (1 - tint) * color[k]! + tint * (look.tint?.color[k] ?? 0);
    }
  }
}
