// SPDX-License-Identifier: Apache-2.0
/** Input devices of the operator: keys and pointer in the view, a gamepad. Each reports to the gate when it is held. */
import * as THREE from "three";

import type { View } from "../scene/view";
import { Button, buttonBits, kKeys, keyVelocity, pressed, stickVelocity } from "./motion";
import type { Pilot, Reading } from "./pilot";
import { Device } from "./pilot";
import { kNotRepeated, Repeats } from "./repeats";

const kGrab = 24; // radius in pixels around the tip or its target in which the pointer grabs it
const kWheel = 2e-5; // m per pixel of the wheel

export class Devices {
  private readonly keys = new Set<string>();
  private readonly repeats = new Repeats(() => this.dropKeys(kNotRepeated));
  private readonly grabbed = new THREE.Vector3();
  private depth = 0;
  private pointer: { id: number; x: number; y: number } | null = null;
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
  }

  /** Nothing is known of the keys any more. @param why  the input that they held ends; empty: as if they were let go */
  private dropKeys(why: string): void {
    const { gate } = this.pilot;
    if (why !== "" && this.keys.has(gate.source ?? "")) gate.release(why);
    for (const code of Object.keys(kKeys)) gate.update(code, false);
    this.keys.clear();
    this.repeats.end();
  }

  /** Keys count while the view has the focus, so that typing elsewhere moves nothing. */
  private watchKeys(place: HTMLElement): void {
    place.addEventListener("keydown", (event) => {
      if (event.code === "KeyC") this.pilot.clutch = true;
      if (this.keys.size > 0) this.repeats.seen(event.repeat); // of several keys only the last one repeats
      if (!(event.code in kKeys) || event.ctrlKey || event.altKey || event.metaKey || !this.pilot.armed) return;
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
        this.pointer = { id: event.pointerId, x: event.clientX - box.left, y: event.clientY - box.top };
      },
      { capture: true },
    );
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      place.addEventListener(end, (event) => {
        if (this.pointer?.id !== event.pointerId) return;
        this.pointer = null;
        this.view.controls.enabled = true;
        this.pilot.gate.update("pointer", false);
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
    const near = (point: THREE.Vector3): boolean => {
      const p = this.view.toScreen(point);
      return Math.hypot(p.x - at.x, p.y - at.y) < kGrab;
    };
    if (!near(arm.tip)) return;
    event.stopPropagation();
    this.view.controls.enabled = false;
    this.grabbed.copy(arm.tip);
    this.depth = 0;
    this.pointer = { id: event.pointerId, ...at };
    place.setPointerCapture(event.pointerId);
    this.pilot.gate.update("pointer", true);
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
      this.pilot.gate.update("gamepad", pressed(pad, Button.hold) || pressed(pad, Button.holdTrigger));
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
      return { device: Device.gamepad, velocity: stickVelocity(pad), buttons: buttonBits(pad) };
    }
    if (source === "pointer" && this.pointer) {
      const point = this.view.onPlane(this.pointer.x, this.pointer.y, this.grabbed) ?? this.grabbed.clone();
      const away = this.view.camera.getWorldDirection(new THREE.Vector3());
      point.addScaledVector(away, this.depth);
      return { device: Device.pointer, position: [point.x, point.y, point.z] };
    }
    return { device: Device.keyboard, velocity: keyVelocity(this.keys) };
  }
}
