// SPDX-License-Identifier: Apache-2.0
/** Check of a trajectory before its start, by the planning service: what `tandem plan check --deployment` asks for. */
import type { ComputationProgress, ComputationResult } from "../wire/messages";
import { ComputationKind, Outcome, ReplyCode } from "../wire/messages";
import type { Answer } from "./commander";

/** The planning service, as a check sees it. */
export interface Planner {
  /** @returns number of the request, which progress and result carry, and the reply that comes at once */
  compute(what: object): { request: bigint; answer: Promise<Answer> };
  /** Cancels, or keeps alive, a computation. */
  tellComputation(kind: number, computation: bigint): void;
}

/** What shall be checked. */
export interface Wanted {
  /** Empty: nothing. */
  yaml: string;
  /** Of the rehearsal. */
  method: string;
  /** Of the rehearsal, by name, as control reports them; those that are missing have the values of the files. */
  parameters: ReadonlyMap<string, string>;
  /** Present joints of all arms; null: not known. */
  joints: readonly number[] | null;
  /** Why no check is asked for now; empty if there is no reason. */
  not: string;
}

export type CheckState =
  | { kind: "none"; reason: string }
  | { kind: "running"; share: number }
  | { kind: "refused"; reason: string }
  /** @param moved  the arms are no longer where they were at the check */
  | { kind: "done"; method: string; result: ComputationResult; moved: boolean };

/** Joints that have moved farther than this are others, as in planning: m and rad. */
const kAway = { translation: 5e-4, rotation: 5e-3 };
const kStill = 1e-5; // m or rad
/** ms: after the last change of the text or of a joint; between two attempts while planning is busy; between two signs of life; until a
 * silent computation is given up. */
const [kTyped, kBusy, kAlive, kSilence] = [400, 1000, 1000, 30_000];

/** The defaults of `tandem plan check`. */
const kDefaults = { kind: ComputationKind.check, stability: 0.05, accept: 1e-5, starts: 12, seed: 1n };

export class TrajectoryCheck {
  private key = "";
  private due = 0;
  private reason = "";
  /** Of the request under way. */
  private running: {
    request: bigint;
    key: string;
    method: string;
    /** ms: of the last progress, and of the last sign of life or cancellation */
    received: number;
    sent: number;
    cancelled: boolean;
    share: number;
  } | null = null;
  private finished: { key: string; state: CheckState; start: ArrayLike<number> } | null = null;
  private joints: readonly number[] | null = null;

  /** @param translation  whether each joint, of all arms in order, is a translation */
  constructor(
    private readonly planner: Planner,
    private readonly translation: readonly boolean[],
  ) {}

  /** Asks for a check when it is due: called periodically. @param now  ms */
  look(now: number, wanted: Wanted): void {
    const key = wanted.yaml === "" ? "" : [wanted.method, ...wanted.parameters, wanted.yaml].join("\n");
    if (key !== this.key) this.due = now + kTyped;
    this.key = key;
    if (wanted.joints?.some((q, j) => Math.abs(q - (this.joints?.[j] ?? q)) > kStill))
      this.due = Math.max(this.due, now + kTyped);
    this.joints = wanted.joints;
    this.reason = wanted.not;
    if (this.running) return this.watch(now);
    const old = this.finished?.key === key && !this.moved();
    if (key !== "" && wanted.not === "" && wanted.joints !== null && !old && now >= this.due) this.ask(now, wanted);
  }

  get state(): CheckState {
    if (this.running && this.running.key === this.key) return { kind: "running", share: this.running.share };
    if (this.finished?.key !== this.key || this.key === "") return { kind: "none", reason: this.reason };
    const { state } = this.finished;
    return state.kind === "done" ? { ...state, moved: this.moved() } : state;
  }

  progressed({ request, fraction }: ComputationProgress, now: number): void {
    if (this.running?.request !== request) return;
    this.running.received = now;
    this.running.share = fraction;
  }
  /** Of a computation of this client. */
  ended(result: ComputationResult): void {
    if (this.running?.request !== result.request) return;
    const { key, method } = this.running;
    this.running = null;
    if (result.outcome === Outcome.cancelled) return;
    const state: CheckState =
      result.outcome === Outcome.failed
        ? { kind: "refused", reason: result.reason }
        : { kind: "done", method, result, moved: false };
    this.finished = { key, state, start: result.start };
  }

  private moved(): boolean {
    const start = this.finished?.start;
    if (!start || start.length === 0) return false;
    return (this.joints ?? []).some(
      (q, j) => Math.abs(q - start[j]!) > (this.translation[j] ? kAway.translation : kAway.rotation),
    );
  }

  private ask(now: number, { yaml, method, parameters }: Wanted): void {
    const { key } = this;
    const { request, answer } = this.planner.compute({
      ...kDefaults,
      trajectory: yaml,
      rehearse: method,
      parameters: [...parameters].map(([name, value]) => ({ name, value })),
    });
    this.running = { request, key, method, received: now, sent: now, cancelled: false, share: 0 };
    void answer.then(({ accepted, code, reason }) => {
      if (accepted || this.running?.request !== request) return;
      this.running = null;
      if (code === ReplyCode.busy) this.due = now + kBusy;
      else this.finished = { key, state: { kind: "refused", reason }, start: [] };
    });
  }

  /** Keeps the computation alive, or ends it if its trajectory is no longer wanted or nothing comes. */
  private watch(now: number): void {
    const running = this.running!;
    const cancel = running.key !== this.key;
    if (now - running.sent < kAlive && (!cancel || running.cancelled)) return;
    running.sent = now;
    running.cancelled = cancel;
    this.planner.tellComputation(cancel ? ComputationKind.cancel : ComputationKind.keepAlive, running.request);
    if (now - running.received < kSilence) return;
    this.running = null;
    this.finished = { key: running.key, state: { kind: "refused", reason: "planning has not answered" }, start: [] };
  }

  /** The link is down: nothing that was asked for is answered. */
  disconnected(): void {
    this.running = null;
    this.finished = null;
  }
}
