// SPDX-License-Identifier: Apache-2.0
/** Place of a camera from which spheres are seen whole, as near as possible, for a given direction of view. */
import * as THREE from "three";

/** A part of the scene that has to be seen: a point with a margin around it, m. */
export interface Extent {
  at: THREE.Vector3;
  radius: number;
}
/** Of the picture, as fractions of its width and height: what lies on top of the scene there hides nothing. */
export interface Insets {
  left: number;
  right: number;
  top: number;
  bottom: number;
}
export interface Fit {
  position: THREE.Vector3;
  /** On the axis of view, at the mean depth of the extents. */
  target: THREE.Vector3;
}

/** Two opposite sides of the picture, as slopes against the axis of view: the most that a point may lie to either. */
interface Sides {
  more: number;
  less: number;
}

/** Along one axis of the picture: the farthest place of the camera along the axis of view, and for a place on that axis the middle of what is
 * allowed across it. The side planes touch the outermost spheres: x - c_x + r sqrt(1 + a^2) <= a (z - c_z) for each slope a. */
function across(points: readonly { x: number; z: number; radius: number }[], { more, less }: Sides) {
  const most = (sign: number, slope: number): number =>
    Math.max(...points.map(({ x, z, radius }) => sign * x - slope * z + radius * Math.hypot(1, slope)));
  const [upper, lower] = [most(1, more), most(-1, less)];
  return {
    depth: -(upper + lower) / (more + less),
    place: (depth: number) => 0.5 * (upper + more * depth - (lower + less * depth)),
  };
}

/** @param extents  at least one @param direction  from the scene to the camera @param up  not parallel to it
 * @param fov  vertical angle of view, rad @param aspect  width by height of the picture */
export function fit(
  extents: readonly Extent[],
  direction: THREE.Vector3,
  up: THREE.Vector3,
  fov: number,
  aspect: number,
  insets: Insets,
): Fit {
  const forward = direction.clone().normalize().negate();
  const right = new THREE.Vector3().crossVectors(forward, up).normalize();
  const upward = new THREE.Vector3().crossVectors(right, forward);
  const slope = Math.tan(0.5 * fov);
  const sides = (less: number, more: number, scale: number): Sides => ({
    less: scale * (1 - 2 * less),
    more: scale * (1 - 2 * more),
  });
  const along = (axis: THREE.Vector3) =>
    extents.map(({ at, radius }) => ({ x: at.dot(axis), z: at.dot(forward), radius }));
  const horizontal = across(along(right), sides(insets.left, insets.right, slope * aspect));
  const vertical = across(along(upward), sides(insets.bottom, insets.top, slope));
  const depth = Math.min(horizontal.depth, vertical.depth);
  const position = new THREE.Vector3()
    .addScaledVector(right, horizontal.place(depth))
    .addScaledVector(upward, vertical.place(depth))
    .addScaledVector(forward, depth);
  const mean = extents.reduce((sum, { at }) => sum + at.dot(forward), 0) / extents.length;
  return { position, target: position.clone().addScaledVector(forward, mean - depth) };
}
