// SPDX-License-Identifier: Apache-2.0
/** Services of the robot: what each last reported of itself, which it does once a second, and whether it still reports. */
import type { DiagnosticArray } from "../wire/messages";
import { age, ageText } from "./age";

/** Whether this is the last message of a service, in which it says why it ends. */
export const isEnd = (message: string): boolean => message.startsWith("ended: "); // runtime::kEnded
const kUp = "tandem up: "; // reason of the stop by which `tandem up` says which process died, and how
const kDown = 15_000; // ms: within it `tandem up` has ended all processes
const kLost = 3000; // ms
const kLevels = ["ok", "warning", "error", "stale"] as const;

export type Condition = (typeof kLevels)[number] | "ended" | "silent";

export interface Service {
  name: string;
  condition: Condition;
  /** What it last said. */
  message: string;
  /** Of that, in words. */
  age: string;
}

export class Services {
  private readonly known = new Map<string, { at: number; level: number; message: string; silent: boolean }>();

  private cause = { reason: "", at: -Infinity };

  /** A stop was requested. */
  stopped(reason: string, now: number): void {
    if (reason.startsWith(kUp)) this.cause = { reason, at: now };
  }
  received({ status }: DiagnosticArray, now: number): void {
    for (const { name, level, message } of status)
      this.known.set(name, { at: now, level, message, silent: this.known.get(name)?.silent ?? false });
  }

  /** In the order in which they first reported. */
  all(now: number): Service[] {
    return [...this.known].map(([name, { at, level, message }]) => {
      const ended = isEnd(message);
      const silent = age(at, now) > kLost;
      const condition = ended ? "ended" : silent ? "silent" : (kLevels[level] ?? "stale");
      return { name, condition, message, age: ageText(age(at, now)) };
    });
  }

  /** Those of which nothing more comes, in words. The process that has died, and those that could not say why they ended, are first: the
   * end of one of them ends the others. */
  gone(now: number): string[] {
    const all = this.all(now);
    const running = [...this.known.values()].filter(({ message }) => !isEnd(message)).map(({ at }) => at);
    const { reason, at: died } = this.cause;
    const cause = Math.max(...running) > died + kDown ? "" : reason;
    const silent = all.filter(({ condition }) => condition === "silent");
    const ended = all.filter(({ condition }) => condition === "ended");
    return [
      ...(cause === "" ? [] : [cause]),
      ...silent.map(({ name, age: last }) => `${name} no longer reports: its last report is ${last}`),
      ...ended.map(({ name, message }) => `${name} ${message}`),
    ];
  }

  /** Services that have fallen silent, or report again, since the last call. One that says that it ends is neither. */
  changes(now: number): { name: string; silent: boolean; age: string }[] {
    return this.all(now).flatMap(({ name, condition, age: last }) => {
      const entry = this.known.get(name)!;
      const silent = condition === "silent";
      if (silent === entry.silent) return [];
      entry.silent = silent;
      return [{ name, silent, age: last }];
    });
  }
}
