// SPDX-License-Identifier: Apache-2.0
/** Whether the robot's data is current, whatever the page shows: in words, and in the log when it changes. */
import { age, ageText } from "../state/age";
import type { Robot } from "../state/robot";
import type { World } from "../state/world";
import type { Link } from "../wire/link";
import type { LogPanel } from "./log";

export class Currency {
  /** For the status of the link. */
  text = "";
  /** partly: all but planning publish; stale: the link is open, and control or drives do not; lost: there is no link. */
  state: "live" | "partly" | "stale" | "lost" = "lost";
  private wasLive = false;
  private wasSilent = false;

  /** @param world  of the robot */
  constructor(
    private readonly robot: Pick<Robot, "lock_step">,
    private readonly world: Pick<World, "live" | "planningSilent" | "heldBack" | "stale" | "age" | "status" | "hal">,
    private readonly link: Pick<Link, "state" | "receivedAt">,
    private readonly messages: Pick<LogPanel, "add">,
  ) {}

  update(now: number): void {
    const { world, link } = this;
    const live = world.live(now);
    const silent = world.planningSilent(now);
    let text = `◉ LIVE ${this.robot.lock_step ? "· lock-step" : ""}`;
    if (silent !== "") text = `◐ LIVE · NO DATA FROM PLANNING · ${silent}`;
    if (link.state !== "open") text = `✕ NO LINK · ${ageText(age(link.receivedAt, now))}`;
    else if (world.heldBack(now)) text = `◔ OLD DATA · ${ageText(world.age(world.status, now))}`;
    else if (world.stale(world.status, now)) text = `◔ NO DATA FROM CONTROL · ${ageText(world.age(world.status, now))}`;
    else if (!live) text = `◔ NO DATA FROM DRIVES · ${ageText(world.age(world.hal, now))}`;
    this.text = text;
    this.state = live ? (silent === "" ? "live" : "partly") : link.state === "open" ? "stale" : "lost";
    // The end of the link itself is an event of its own.
    if (this.wasLive && !live && link.state === "open")
      this.messages.add("bad", `The data is out of date: ${text.slice(2)}`);
    if (live && !this.wasLive) this.messages.add("info", "The data is current");
    if (live && this.wasLive && (silent !== "") !== this.wasSilent)
      this.messages.add(
        silent === "" ? "info" : "bad",
        silent === "" ? "Planning publishes again" : `Planning no longer publishes: its last data is ${silent}`,
      );
    this.wasSilent = silent !== "";
    this.wasLive = live;
  }
}
