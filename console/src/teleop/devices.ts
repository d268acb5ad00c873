// SPDX-License-Identifier: Apache-2.0
/** Input devices of the operator: keys and pointer in the view, a gamepad. Each reports to the gate when it is held. */
import * as THREE from "three";

import type { View } from "../scene/view";
import {
  Button,
  buttonBits,
  kKeys,
  kTurnKeys,
  keyTurn,
  keyVelocity,
  pressed,
  stickTurn,
  stickVelocity,
  type Vector,
} from "./motion";
import type { Pilot, Reading } from "./pilot";
import { Device } from "./pilot";
import { kNotRepeated, Repeats } from "./repeats";
import { ballPoint, type Part, partAt, turnBetween } from "./ring";

const kAllKeys = [...Object.keys(kKeys), ...Object.keys(kTurnKeys)];
const kWheel = 2e-5; // m per pixel of the wheel

export class Devices {
  private readonly keys = new Set<string>();
  private readonly repeats = new Repeats(() => this.dropKeys(kNotRepeated));
  private readonly grabbed = new THREE.Vector3();
  private depth = 0;
  /** Of the ball around the tip since it was grabbed, in the robot's base frame. */
  private readonly turned = new THREE.Quaternion();
  private pointer: { id: number; part: Part; x: number; y: number } | null = null;
  private pad: number | null = null;

  constructor(
    private readonly view: View,
    private readonly pilot: Pilot,
    private readonly stop: (reason: string) => void,
  ) {
    pilot.read = (source) => this.read(source);
    pilot.view = () => this.view.camera.quaternion.toArray();
    pilot.gate.allow("device", true);
    this.watchWindow();
    this.watchKeys(view.place);
    this.watchPointer(view.place);
    this.watchGamepads();
  }

  private watchWindow(): void {
    const gate = this.pilot.gate;
    const look = (): void => {
      gate.allow("visible", document.visibilityState === "visible");
      gate.allow("focused", document.hasFocus());
    };
    const lost = (): void => {
      gate.allow("focused", false);
      this.dropKeys("");
    };
    window.addEventListener("blur", lost);
    window.addEventListener("pagehide", lost);
    window.addEventListener("focus", look);
    document.addEventListener("visibilitychange", look);
    look();
    // Whatever may take the release of a key or of the pointer from the page.
    const ends = (why: string): void => {
      if (gate.source !== "gamepad") gate.release(why);
    };
    window.addEventListener("contextmenu", () => ends("a menu was asked for"), { capture: true });
    const another = (event: PointerEvent): void => {
      if (this.pointer && event.pointerId !== this.pointer.id) ends("a second pointer was pressed");
    };
    window.addEventListener("pointerdown", another, { capture: true });
    const button = (event: MouseEvent): void => {
      if (this.pointer && event.button !== 0) ends("a second button was pressed");
    };
    window.addEventListener("mousedown", button, { capture: true });
  }

  /** Nothing is known of the keys any more. @param why  the input that they held ends; empty: as if they were let go */
  private dropKeys(why: string): void {
    const { gate } = this.pilot;
    if (why !== "" && this.keys.has(gate.source ?? "")) gate.release(why);
    for (const code of kAllKeys) gate.update(code, false);
    this.keys.clear();
    this.repeats.end();
  }

  /** Keys count while the view has the focus, so that typing elsewhere moves nothing. */
  private watchKeys(place: HTMLElement): void {
    place.addEventListener("keydown", (event) => {
      if (event.code === "KeyC") this.pilot.clutch = true;
      if (this.keys.size > 0) this.repeats.seen(event.repeat); // of several keys only the last one repeats
      const offered = event.code in kKeys || (this.pilot.turns && event.code in kTurnKeys);
      if (!offered || event.ctrlKey || event.altKey || event.metaKey || !this.pilot.armed) return;
      event.preventDefault();
      if (event.repeat) return; // held since before a cut-off: it must be pressed anew
      this.keys.add(event.code);
      this.pilot.gate.update(event.code, true);
      this.repeats.seen(false);
    });
    const up = (event: KeyboardEvent): void => {
      if (event.code === "KeyC") this.pilot.clutch = false;
      this.keys.delete(event.code);
      // The first of several keys holds the gate; another that is still down takes over from it.
      const wasHolder = this.pilot.gate.source === event.code;
      const next = [...this.keys][0];
      if (wasHolder && next !== undefined) {
        this.pilot.gate.hand(event.code, next);
        return;
      }
      this.pilot.gate.update(event.code, false);
    };
    window.addEventListener("keyup", up);
    place.addEventListener("blur", () => this.dropKeys(""));
  }

  private watchPointer(place: HTMLElement): void {
    // Captured, before the camera controls receive it.
    place.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    place.addEventListener(
      "pointermove",
      (event) => {
        if (this.pointer?.id !== event.pointerId) return;
        event.stopPropagation();
        const box = place.getBoundingClientRect();
        this.drag(event.clientX - box.left, event.clientY - box.top);
      },
      { capture: true },
    );
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      place.addEventListener(end, (event) => {
        if (this.pointer?.id !== event.pointerId) return;
        const { part } = this.pointer;
        this.pointer = null;
        this.view.controls.enabled = true;
        this.pilot.gate.update(part, false);
      });
    }
    place.addEventListener(
      "wheel",
      (event) => {
        if (!this.pointer) return;
        event.preventDefault();
        event.stopPropagation();
        this.depth -= kWheel * event.deltaY;
      },
      { capture: true, passive: false },
    );
  }

  private grab(event: PointerEvent): void {
    const place = this.view.place;
    if (!(event.target instanceof HTMLCanvasElement)) return; // a button over the scene
    place.focus();
    const arm = this.view.arms[this.pilot.choice.arm];
    if (event.button !== 0 || !this.pilot.armed || !arm?.hasTip) return;
    const box = place.getBoundingClientRect();
    const at = { x: event.clientX - box.left, y: event.clientY - box.top };
    const tip = this.view.toScreen(arm.tip);
    const part = partAt(Math.hypot(tip.x - at.x, tip.y - at.y));
    if (part === null || (part === "ring" && !this.pilot.turns) || this.pointer) return;
    event.stopPropagation();
    this.view.controls.enabled = false;
    this.grabbed.copy(arm.tip);
    this.depth = 0;
    this.turned.identity();
    this.pointer = { id: event.pointerId, part, ...at };
    place.setPointerCapture(event.pointerId);
    this.pilot.gate.update(part, true);
  }

  /** The pointer that has grabbed something moves to these pixels. */
  private drag(x: number, y: number): void {
    const pointer = this.pointer!;
    if (pointer.part === "ring") {
      const centre = this.view.toScreen(this.grabbed);
      const point = (at: { x: number; y: number }): Vector => ballPoint(at.x - centre.x, centre.y - at.y);
      const { quaternion } = this.view.camera;
      const turn = new THREE.Quaternion(...turnBetween(point(pointer), point({ x, y })));
      this.turned.premultiply(turn.premultiply(quaternion).multiply(quaternion.clone().conjugate())).normalize();
    }
    this.pointer = { ...pointer, x, y };
  }

  private watchGamepads(): void {
    window.addEventListener("gamepadconnected", () => this.startPolling());
    window.addEventListener("gamepaddisconnected", (event) => {
      if (event.gamepad.index !== this.pad) return;
      this.pad = null;
      if (this.pilot.gate.source === "gamepad") this.pilot.gate.release("the gamepad was disconnected");
      this.pilot.gate.update("gamepad", false);
    });
  }
  private polling = false;
  private startPolling(): void {
    if (this.polling) return;
    this.polling = true;
    let stopWasDown = false;
    setInterval(() => {
      const pad = this.gamepad();
      if (!pad) return;
      this.pilot.gate.update("gamepad", pressed(pad, Button.hold));
      if (this.pilot.gate.source === "gamepad") this.pilot.clutch = pressed(pad, Button.clutch);
      const stopDown = pressed(pad, Button.leaveStop);
      if (stopDown && !stopWasDown) this.stop("stop on the gamepad");
      stopWasDown = stopDown;
    }, 8);
  }
  gamepad(): Gamepad | null {
    const pads = navigator.getGamepads().filter((pad): pad is Gamepad => pad !== null && pad.connected);
    const pad = pads.find((p) => p.index === this.pad) ?? pads.find((p) => p.mapping === "standard") ?? null;
    this.pad = pad?.index ?? null;
    return pad;
  }

  private read(source: string): Reading {
    if (source === "gamepad") {
      const pad = this.gamepad();
      if (!pad) {
        this.pilot.gate.release("the gamepad was disconnected");
        return { device: Device.gamepad, velocity: [0, 0, 0] };
      }
      const [velocity, angular] = [stickVelocity(pad), stickTurn(pad)];
      return { device: Device.gamepad, velocity, angular, buttons: buttonBits(pad) };
    }
    if (source === "ring" && this.pointer) {
      const { x, y, z } = this.grabbed;
      return { device: Device.pointer, position: [x, y, z], orientation: this.turned.toArray() };
    }
    if (source === "pointer" && this.pointer) {
      const point = this.view.onPlane(this.pointer.x, this.pointer.y, this.grabbed) ?? this.grabbed.clone();
      const away = this.view.camera.getWorldDirection(new THREE.Vector3());
      point.addScaledVector(away, this.depth);
      return { device: Device.pointer, position: [point.x, point.y, point.z] };
    }
    return { device: Device.keyboard, velocity: keyVelocity(this.keys), angular: keyTurn(this.keys) };
  }
}
