// SPDX-License-Identifier: Apache-2.0
/** The scene, drawn only after changes. */
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import type { Robot } from "../state/robot";
import { shortName } from "../state/descriptions";
import { ArmView } from "./armview";
import { baseAxis } from "./base";
import { CommandedFrame } from "./commanded";
import { fit } from "./fit";
import type { Extent, Insets } from "./fit";
import { ForcesView } from "./forces";
import { Guides } from "./guides";
import { ObjectView } from "./object";
import { PreviewView } from "./preview";
import { regionsView } from "./regions";
import { SpanView } from "./span";

export const kPresets = ["home", "front", "side", "top", "tips", "endoscope"] as const;
export type Preset = (typeof kPresets)[number];

/** Around each tip, m, of what is seen of it from near. */
const kNearTips = 0.025;
/** Minimum time between images without graphics hardware, which leaves processor time for the operator's input. */
const kSoftwareGap = 100; // ms

export class View {
  readonly arms: ArmView[];
  readonly guides: Guides;
  /** Of teleoperation. */
  readonly commanded = new CommandedFrame();
  /** A checked trajectory. */
  readonly preview: PreviewView;
  /** Of a joint. */
  readonly span = new SpanView();
  /** Grasped object. */
  readonly object: ObjectView | null;
  readonly forces: ForcesView;
  readonly camera: THREE.PerspectiveCamera;
  readonly controls: OrbitControls;
  readonly scene = new THREE.Scene();
  drawn = 0;
  /** What lies on top of the scene. */
  insets: () => Insets = () => ({ left: 0, right: 0, top: 0, bottom: 0 });
  /** No graphics hardware: no antialiasing, for more frames per second. */
  readonly software: boolean;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly resized = new ResizeObserver(() => this.resize());
  private dirty = true;
  /** What the camera was set to; null: the operator has moved it since. */
  private looked: Preset | null = "home";
  private next = 0;
  private fence: WebGLSync | null = null;
  /** Vectors in the robot's base frame: direction into the body, and centre of the arms' bases. */
  private readonly into: THREE.Vector3;
  private readonly middle: THREE.Vector3;
  private readonly reach: number;
  private readonly up = new THREE.Vector3(1, 0, 0);

  constructor(
    readonly place: HTMLElement,
    robot: Robot,
  ) {
    // The drawing buffer is preserved, so that screenshots of the page contain the scene.
    this.software = drawnInSoftware();
    this.renderer = new THREE.WebGLRenderer({
      antialias: !this.software,
      preserveDrawingBuffer: true,
      powerPreference: "high-performance",
    });
    this.renderer.setPixelRatio(this.software ? 1 : Math.min(window.devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.setAttribute("aria-hidden", "true");
    place.append(canvas);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.002, 5);
    this.camera.up.copy(this.up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false; // damping would keep drawing, and move the view under the operator's pointer
    this.controls.addEventListener("change", () => this.moved());
    this.controls.addEventListener("start", () => (this.looked = null));
    this.arms = robot.arms.map((arm) => new ArmView(arm, shortName(arm.name)));
    this.guides = new Guides(robot.arms.length);
    this.preview = new PreviewView(robot.arms);
    this.object = robot.object && new ObjectView(robot.object);
    this.forces = new ForcesView(robot.arms);
    this.into = new THREE.Vector3();
    this.middle = new THREE.Vector3();
    for (const arm of robot.arms) {
      this.into.add(new THREE.Vector3().fromArray(baseAxis(arm, [0, 0, 1])));
      this.middle.addScaledVector(new THREE.Vector3().fromArray(arm.base.position), 1 / robot.arms.length);
    }
    if (this.into.lengthSq() < 1e-6) this.into.set(0, 0, 1);
    this.into.normalize();
    this.reach = Math.max(0.1, ...robot.arms.map((arm) => Math.max(...arm.tubes.map((tube) => tube.length))));
    this.furnish(robot);
    this.resized.observe(place);
    this.resize();
  }

  private furnish(robot: Robot): void {
    this.scene.background = new THREE.Color("#0b0f14");
    const key = new THREE.DirectionalLight("#ffffff", 2.2);
    this.camera.add(key); // the light moves with the camera, so that visible sides are always lit
    key.position.set(0.3, 0.6, 1);
    this.scene.add(this.camera, new THREE.HemisphereLight("#dfe8f5", "#2a3442", 1.1));
    this.scene.add(
      this.guides.group,
      this.commanded.group,
      this.preview.group,
      this.span.group,
      this.forces.group,
      this.ruler(),
      ...this.arms.map((arm) => arm.group),
    );
    if (this.object) this.scene.add(this.object.mesh);
    this.scene.add(regionsView(robot.regions, this.focus(), 0.1 * this.reach));
    if (robot.port) {
      const { frame, radius } = robot.port;
      const port = new THREE.Mesh(
        new THREE.TorusGeometry(radius, 0.0008, 8, 64),
        new THREE.MeshStandardMaterial({ color: "#9aa7b5", roughness: 0.5 }),
      );
      port.position.fromArray(frame.position);
      port.quaternion.fromArray(frame.orientation);
      this.scene.add(port);
    }
  }

  /** Ruler from the entry point along the insertion direction: a tick every 10 mm, a long one every 50 mm. */
  private ruler(): THREE.LineSegments {
    const points: THREE.Vector3[] = [];
    const from = this.middle.clone().addScaledVector(this.up, -0.03);
    const length = Math.ceil(this.reach / 0.05) * 0.05;
    points.push(from, from.clone().addScaledVector(this.into, length));
    for (let tick = 0; 0.01 * tick <= length + 1e-9; ++tick) {
      const at = from.clone().addScaledVector(this.into, 0.01 * tick);
      points.push(at, at.clone().addScaledVector(this.up, tick % 5 === 0 ? 0.006 : 0.0025));
    }
    return new THREE.LineSegments(
      new THREE.BufferGeometry().setFromPoints(points),
      new THREE.LineBasicMaterial({ color: "#4a5c6e" }),
    );
  }

  /** Point of interest: the centre of the tips, or of their reach. */
  private focus(): THREE.Vector3 {
    const tips = this.arms.filter((arm) => arm.hasTip).map((arm) => arm.tip);
    if (tips.length === 0) return this.middle.clone().addScaledVector(this.into, 0.4 * this.reach);
    return tips.reduce((sum, tip) => sum.add(tip), new THREE.Vector3()).divideScalar(tips.length);
  }

  look(preset: Preset): void {
    this.looked = preset;
    const tips = this.focus();
    const near = this.arms.map(({ hasTip, tip }) => ({ at: hasTip ? tip : tips, radius: kNearTips }));
    // With room for what the tips are going to do.
    const all = [...this.arms.flatMap((arm) => arm.extents(this.reach)), ...near];
    const side = new THREE.Vector3().crossVectors(this.up, this.into).normalize();
    const away = side.clone().negate();
    const fov = (this.camera.fov * Math.PI) / 180;
    const from = (direction: THREE.Vector3, extents: readonly Extent[], up = this.up): void => {
      const { position, target } = fit(extents, direction, up, fov, this.camera.aspect, this.insets());
      this.camera.up.copy(up);
      this.camera.position.copy(position);
      this.controls.target.copy(target);
    };
    switch (preset) {
      case "home":
        from(away.addScaledVector(this.up, 0.55).addScaledVector(this.into, -0.35), all);
        break;
      case "front":
        from(this.into, all);
        break;
      case "side":
        from(away, all);
        break;
      case "top":
        from(this.up, all, away);
        break;
      case "tips":
        from(away.addScaledVector(this.up, 0.6).addScaledVector(this.into, -0.8), near);
        break;
      case "endoscope":
        // From between the bases along the insertion direction, like an endoscope in the port.
        this.camera.up.copy(this.up);
        this.controls.target.copy(tips);
        this.camera.position
          .copy(this.middle)
          .addScaledVector(this.up, 0.012)
          .addScaledVector(this.into, 0.3 * Math.max(0.08, tips.distanceTo(this.middle)));
        break;
    }
    this.controls.update();
    this.moved();
  }

  /** The camera stands elsewhere. What lies over the scene follows at once, not after the next image: a handle is grabbed where it is shown. */
  private moved(): void {
    this.camera.updateMatrixWorld();
    this.touch();
  }

  /** It is not shown any more: browsers have few contexts of their graphics. */
  close(): void {
    this.resized.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  touch(): void {
    this.dirty = true;
  }
  /** @returns whether anything was drawn. */
  draw(now: number): boolean {
    if (!this.dirty || now < this.next || !this.lastIsDone()) return false;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.next = this.software ? now + kSoftwareGap : now;
    this.drawn += 1;
    return true;
  }

  /** Images queued in the graphics driver would block the page, and with it the operator's input. */
  private lastIsDone(): boolean {
    if (!this.fence) return true;
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    if (gl.clientWaitSync(this.fence, 0, 0) === gl.TIMEOUT_EXPIRED) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    return true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.looked) this.look(this.looked); // a tablet that is turned shows the arms whole
    this.touch();
  }

  /** Pixels from the upper left corner of the element. */
  toScreen(point: THREE.Vector3): { x: number; y: number } {
    const p = point.clone().project(this.camera);
    return { x: (0.5 + 0.5 * p.x) * this.place.clientWidth, y: (0.5 - 0.5 * p.y) * this.place.clientHeight };
  }
  /** Point at these pixels in the plane through `through` that faces the viewer. */
  onPlane(x: number, y: number, through: THREE.Vector3): THREE.Vector3 | null {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(
      new THREE.Vector2((2 * x) / this.place.clientWidth - 1, 1 - (2 * y) / this.place.clientHeight),
      this.camera,
    );
    const facing = this.camera.getWorldDirection(new THREE.Vector3());
    return ray.ray.intersectPlane(
      new THREE.Plane().setFromNormalAndCoplanarPoint(facing, through),
      new THREE.Vector3(),
    );
  }
}

function drawnInSoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}
