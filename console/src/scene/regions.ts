// SPDX-License-Identifier: Apache-2.0
/** Regions that targets of tips do not enter, and the box that they do not leave. */
import * as THREE from "three";

import type { Box, Region, Regions } from "../state/robot";
import { kForbidden, kWorkspace } from "./colors";

const vector = (v: readonly number[]): THREE.Vector3 => new THREE.Vector3().fromArray(v);

function boxOf({ min, max }: Box): THREE.BoxGeometry {
  const size = vector(max).sub(vector(min));
  const geometry = new THREE.BoxGeometry(size.x, size.y, size.z);
  const middle = vector(min).add(vector(max)).multiplyScalar(0.5);
  geometry.translate(middle.x, middle.y, middle.z);
  return geometry;
}

/** Surface of a region. @param reach  m: a plane is drawn as a square of this half width about the foot of `near` */
export function surfaceOf(region: Region, near: THREE.Vector3, reach: number): THREE.BufferGeometry {
  if (region.sphere) {
    const [x = 0, y = 0, z = 0] = region.sphere.center;
    return new THREE.SphereGeometry(region.sphere.radius, 14, 8).translate(x, y, z);
  }
  if (region.box) return boxOf(region.box);
  const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(
    vector(region.half_space!.normal),
    vector(region.half_space!.point),
  );
  const foot = plane.projectPoint(near, new THREE.Vector3());
  const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), plane.normal);
  return new THREE.PlaneGeometry(2 * reach, 2 * reach, 2, 2).applyQuaternion(turn).translate(foot.x, foot.y, foot.z);
}

/** All regions of a deployment. @param near, reach  the part of space in which the arms work */
export function regionsView(regions: Regions, near: THREE.Vector3, reach: number): THREE.Group {
  const group = new THREE.Group();
  for (const region of regions.forbidden) {
    const surface = surfaceOf(region, near, reach);
    const fill = new THREE.MeshBasicMaterial({
      color: kForbidden,
      transparent: true,
      opacity: 0.13,
      side: THREE.DoubleSide,
      depthWrite: false,
    });
    const mesh = new THREE.Mesh(surface, fill);
    mesh.name = region.name;
    group.add(
      mesh,
      new THREE.LineSegments(
        new THREE.WireframeGeometry(surface),
        new THREE.LineBasicMaterial({ color: kForbidden, transparent: true, opacity: 0.5 }),
      ),
    );
  }
  if (regions.workspace)
    group.add(
      new THREE.LineSegments(
        new THREE.EdgesGeometry(boxOf(regions.workspace)),
        new THREE.LineBasicMaterial({ color: kWorkspace }),
      ),
    );
  return group;
}
