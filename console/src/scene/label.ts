// SPDX-License-Identifier: Apache-2.0
import * as THREE from "three";

/** Height of a label, m. */
export const kLabel = 0.009;

/** A short text that always faces the viewer. @param size height, m. */
export function label(text: string, color: string, size = kLabel): THREE.Sprite {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d")!;
  pen.font = "600 48px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 8;
  pen.strokeStyle = "#0b0f14";
  pen.strokeText(text, 32, 34, 60);
  pen.fillStyle = color;
  pen.fillText(text, 32, 34, 60);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map: texture, depthTest: false }));
  sprite.scale.setScalar(size);
  sprite.renderOrder = 10;
  return sprite;
}
