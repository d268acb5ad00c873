// SPDX-License-Identifier: Apache-2.0
/** Method of redundancy resolution and its parameters, which can be changed while it runs. */
import { parametersOf } from "../state/robot";
import { nameOf, valuesOf } from "../state/descriptions";
import { Action } from "../wire/messages";
import type { Context, Panel } from "./context";
import { order, whyNotMove } from "./context";
import { action, card, h, setAttribute, setClass, setText, setUsable } from "./dom";

interface Row {
  name: string;
  input: HTMLInputElement;
  configured: number;
}

export class MethodPanel implements Panel {
  readonly element: HTMLElement;
  private readonly options: [HTMLButtonElement, string][];
  private readonly solver = h("output.line", { id: "solver" });
  private readonly table = h("div.parameters", { role: "group", "aria-label": "Parameters" });
  private rows: Row[] = [];
  private readonly bounds = h("select", { "aria-label": "Bounds", id: "bounds" });
  private shown = "";
  /** Parameters set by this page, by name: the wire does not carry those set by other clients. */
  private readonly changed = new Map<string, number>();
  private readonly apply: HTMLButtonElement;

  constructor(private readonly c: Context) {
    const library = c.robot.control.method_library;
    const methods = valuesOf("Method").filter(({ name }) => name !== "foreign" || library !== "");
    this.options = methods.map(({ name, meaning: built }) => {
      const meaning = name === "foreign" ? `${built}: ${library}` : built;
      const button = action(name, meaning, () => void order(c, `Method ${name}`, c.commander.method(name)), "option");
      button.setAttribute("role", "radio");
      button.dataset["method"] = name;
      button.append(h("small", {}, meaning));
      return [button, name];
    });
    for (const { name } of valuesOf("BoundsKind")) this.bounds.append(h("option", { value: name }, name));
    this.bounds.addEventListener(
      "change",
      () => void order(c, `Bounds ${this.bounds.value}`, c.commander.parameter("bounds", this.bounds.value)),
    );
    this.apply = action("Apply", "Apply changed values", () => void this.send());
    this.apply.id = "apply";
    this.element = card(
      "Method",
      h("div.options", { role: "radiogroup", "aria-label": "Method" }, ...this.options.map(([button]) => button)),
      this.solver,
      h("label.parameter", {}, h("span", {}, "bounds on velocities"), this.bounds),
      this.table,
      h("div.row", {}, this.apply),
      h(
        "p.fine",
        {},
        "Values start as configured; those that this page has set are marked. Values set by other clients are not reported.",
      ),
    );
  }

  private show(method: string): void {
    if (method === this.shown) return;
    this.shown = method;
    this.rows = parametersOf(this.c.robot, method).map(({ name, value }) => {
      const input = h("input", { type: "text", inputmode: "decimal", "data-parameter": name, "aria-label": name });
      input.value = String(this.changed.get(name) ?? value);
      input.addEventListener("keydown", (event) => event.key === "Enter" && void this.send());
      return { name, input, configured: value };
    });
    this.table.replaceChildren(
      ...this.rows.map(({ name, input }) => h("label.parameter", {}, h("span", {}, name), input)),
    );
  }

  private inForce(row: Row): number {
    return this.changed.get(row.name) ?? row.configured;
  }
  private async send(): Promise<void> {
    if (whyNotMove(this.c, performance.now()) !== "") return;
    for (const row of this.rows) {
      const text = row.input.value.trim();
      if (Number(text) === this.inForce(row)) continue;
      // Control checks the number and returns what it expected.
      if (await order(this.c, `${row.name} = ${text}`, this.c.commander.parameter(row.name, text)))
        this.changed.set(row.name, Number(text));
    }
  }

  update(now: number): void {
    const status = this.c.world.controlStatus();
    const method = status ? nameOf("Method", status.method, "") : "";
    this.show(method);
    const why = whyNotMove(this.c, now) || this.c.world.whyNot(Action.setMethod);
    for (const [button, name] of this.options) {
      setAttribute(button, "aria-checked", name === method ? "true" : "false");
      setUsable(button, why);
    }
    setUsable(this.apply, why);
    this.bounds.disabled = why !== "";
    const bounds = nameOf("BoundsKind", status?.bounds ?? 0, "");
    if (document.activeElement !== this.bounds && this.bounds.value !== bounds) this.bounds.value = bounds;
    for (const row of this.rows) {
      setClass(row.input, "ours", this.changed.has(row.name));
      setClass(row.input, "edited", Number(row.input.value) !== this.inForce(row));
    }
    setText(
      this.solver,
      status
        ? `${nameOf("SolveStatus", status.solve_status)} · ${status.iterations} iterations · ${(1e3 * status.solve_time).toFixed(3)} ms`
        : "",
    );
  }
}
