// SPDX-License-Identifier: Apache-2.0
/** Method of redundancy resolution and its parameters. The values shown are those that control reports. */
import { parametersOf } from "../state/robot";
import { nameOf, valuesOf } from "../state/descriptions";
import { Choice, Reasons } from "./choice";
import type { Context, Panel } from "./context";
import { reportedByControl, whyNot } from "./context";
import { action, card, h, setAttribute, setClass, setText, setUsable } from "./dom";

interface Row {
  name: string;
  input: HTMLInputElement;
  /** Of the files. */
  configured: number;
  /** The value that the input was last set to by this program. */
  shown: string;
}

export class MethodPanel implements Panel {
  readonly element: HTMLElement;
  private readonly options: [HTMLButtonElement, string][];
  private readonly solver = h("output.line", { id: "solver" });
  private readonly table = h("div.parameters", { role: "group", "aria-label": "Parameters" });
  private readonly reasons = new Reasons();
  private rows: Row[] = [];
  private readonly bounds: Choice;
  private shown = "";
  private readonly apply: HTMLButtonElement;

  constructor(private readonly c: Context) {
    const library = c.robot.control.method_library;
    const methods = valuesOf("Method").filter(({ name }) => name !== "foreign" || library !== "");
    this.options = methods.map(({ name, meaning: built }) => {
      const meaning = name === "foreign" ? `${built}: ${library}` : built;
      const button = action(name, meaning, () => this.sendMethod(name), "option");
      button.setAttribute("role", "radio");
      button.dataset["method"] = name;
      button.append(h("small", {}, meaning));
      return [button, name];
    });
    const kinds = valuesOf("BoundsKind").map(({ name }) => ({ value: name, text: name }));
    this.bounds = new Choice("bounds", "Bounds on velocities", kinds, () => this.sendBounds());
    this.apply = action("Apply", "Apply changed values", () => void this.send());
    this.apply.id = "apply";
    this.element = card(
      "Method",
      this.reasons.element,
      h("div.options", { role: "radiogroup", "aria-label": "Method" }, ...this.options.map(([button]) => button)),
      this.solver,
      h("div.parameter", {}, h("span", {}, "bounds on velocities"), this.bounds.element),
      this.table,
      h("div.row", {}, this.apply),
      h(
        "p.fine",
        {},
        "Values as control reports them. Marked: not those of the files. Dashed: typed, and not applied.",
      ),
    );
  }

  private show(method: string): void {
    if (method === this.shown) return;
    this.shown = method;
    const parameters = parametersOf(this.c.robot, method);
    this.rows = parameters.map(({ name, value, unit }) => {
      const input = h("input", {
        type: "text",
        inputmode: "decimal",
        autocomplete: "off",
        "data-parameter": name,
        "aria-label": unit === "" ? name : `${name}, ${unit}`,
        readonly: true,
      });
      input.addEventListener("keydown", (event) => event.key === "Enter" && void this.send());
      return { name, input, configured: value, shown: "" };
    });
    this.table.replaceChildren(
      ...this.rows.map(({ name, input }, k) => {
        const { meaning, unit } = parameters[k]!;
        return h("label.parameter", { title: meaning }, h("span", {}, name), input, h("span.unit", {}, unit));
      }),
    );
  }

  private sendMethod(name: string): void {
    const there = (): boolean => nameOf("Method", this.c.world.controlStatus()?.method ?? -1, "") === name;
    void this.c.orders.give(`Method ${name}`, this.c.commander.method(name), reportedByControl(this.c, there));
  }
  private sendBounds(): void {
    const { value } = this.bounds;
    const there = (): boolean => this.boundsInForce() === value;
    const asked = this.c.commander.parameter("bounds", value);
    void this.c.orders.give(`Bounds ${value}`, asked, reportedByControl(this.c, there));
  }
  private boundsInForce = (): string => nameOf("BoundsKind", this.c.world.controlStatus()?.bounds ?? -1, "");

  private edited = ({ input, shown }: Row): boolean => input.value.trim() !== shown;
  private async send(): Promise<void> {
    if (whyNot(this.c, "method", performance.now()) !== "") return;
    for (const row of this.rows.filter(this.edited)) {
      const text = row.input.value.trim();
      const there = (): boolean => Number(this.c.world.parameters.get(row.name)) === Number(text);
      // Control checks the number and returns what it expected.
      const asked = this.c.commander.parameter(row.name, text);
      await this.c.orders.give(`${row.name} = ${text}`, asked, reportedByControl(this.c, there));
    }
  }

  update(now: number): void {
    const status = this.c.world.controlStatus();
    const method = status ? nameOf("Method", status.method, "") : "";
    this.show(method);
    const why = whyNot(this.c, "method", now);
    this.reasons.show([["Method and parameters", why]]);
    for (const [button, name] of this.options) {
      setAttribute(button, "aria-checked", name === method ? "true" : "false");
      setUsable(button, why);
    }
    setUsable(this.apply, why);
    this.bounds.allow(why);
    this.bounds.value = this.boundsInForce();
    for (const row of this.rows) this.updateRow(row, why);
    setText(
      this.solver,
      status
        ? `${nameOf("SolveStatus", status.solve_status)} · ${status.iterations} iterations · ${(1e3 * status.solve_time).toFixed(3)} ms`
        : "",
    );
  }

  private updateRow(row: Row, why: string): void {
    const reported = this.c.world.parameters.get(row.name);
    const value = reported === undefined ? undefined : Number(reported);
    const text = value === undefined ? "" : String(value);
    if (text !== row.shown) {
      const typed = this.edited(row) && Number(row.input.value) !== value;
      row.shown = text;
      if (!typed) row.input.value = text;
    }
    row.input.readOnly = why !== "";
    setAttribute(row.input, "placeholder", value === undefined ? "not reported yet" : "");
    setAttribute(row.input, "title", why);
    setAttribute(row.input, "aria-disabled", why === "" ? "false" : "true");
    setClass(row.input, "ours", value !== undefined && value !== row.configured);
    setClass(row.input, "edited", this.edited(row));
  }
}
