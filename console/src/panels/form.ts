// SPDX-License-Identifier: Apache-2.0
/** A trajectory as a form in mm, with a picture of its path. The YAML beside it follows each change. */
import { shortName } from "../state/descriptions";
import type { Field, Form, ShapeName } from "../state/shape";
import { editedName, kCommon, kShapeNames, kShapes, keysIn, pathOf, planeOf, yamlOf } from "../state/shape";
import { Choice } from "./choice";
import { h, setAttribute, setText } from "./dom";

const kSvg = "http://www.w3.org/2000/svg";
const kSize = 130; // of the picture, px
const kMargin = 18;

export class TrajectoryForm {
  readonly element: HTMLElement;
  private readonly shape: Choice;
  private readonly arm: Choice;
  private readonly other: Choice;
  private readonly fields = h("div.fields", {});
  private readonly picture = document.createElementNS(kSvg, "svg");
  private readonly caption = h("p.fine", { id: "form-caption" });
  private readonly note = h("p.fine", { id: "form-note" });
  private readonly inputs = new Map<string, HTMLInputElement[]>();
  private values = new Map<string, readonly string[]>();
  private name = "form";
  /** Arm whose tip follows the shape. */
  private tip: string;
  /** Why the trajectory cannot be edited as a form; empty: it can. */
  private refused = "";

  /** @param arms  names @param written  called with the text after each change by the operator */
  constructor(
    private readonly arms: readonly string[],
    private readonly written: (yaml: string) => void,
  ) {
    const names = kShapeNames.map((value) => ({ value, text: value }));
    const tips = arms.map((value) => ({ value, text: shortName(value) }));
    this.shape = new Choice("form-shape", "Shape", names, () => this.reshape());
    this.arm = new Choice("form-arm", "Arm whose tip follows the shape", tips, () => this.write());
    this.tip = this.arm.value;
    const others = [{ value: "", text: "none" }, ...tips];
    this.other = new Choice("form-other", "Arm that keeps its relative position", others, () => this.write());
    this.other.value = arms[1] ?? "";
    this.offerOthers();
    this.picture.setAttribute("viewBox", `0 0 ${kSize} ${kSize}`);
    this.picture.setAttribute("role", "img");
    this.picture.setAttribute("aria-label", "The path of the tip");
    const row = (label: string, choice: HTMLElement): HTMLElement =>
      h("div.field", {}, h("span", {}, label), h("div", {}, choice));
    this.element = h(
      "details.form",
      { id: "trajectory-form" },
      h("summary", {}, "As a form, in mm"),
      this.note,
      row("shape", this.shape.element),
      row("tip of arm", this.arm.element),
      arms.length > 1 ? row("keeps its relative position", this.other.element) : null,
      h("figure", {}, this.picture, this.caption),
      this.fields,
    );
    this.build();
  }

  /** Shows a trajectory. @param form  of it, or the reason why it cannot be edited here */
  show(form: Form | string): void {
    this.refused = typeof form === "string" ? form : "";
    if (typeof form !== "string") {
      this.name = form.name;
      this.values = new Map(form.values);
      this.shape.value = form.shape;
      this.arm.value = form.arm;
      this.other.value = form.other;
      this.offerOthers();
    }
    for (const choice of [this.shape, this.arm, this.other]) choice.allow(this.refused);
    this.build();
    this.follows(true);
  }
  /** Whether the text is the form's. */
  follows(does: boolean): void {
    const other = "The YAML is not that of this form. A change in the form replaces it.";
    const locked = `Not editable as a form: ${this.refused}. The YAML below is editable.`;
    setText(this.note, this.refused !== "" ? locked : does ? "" : other);
  }
  /** Marks the fields whose keys a reason of the parser names. */
  blame(reason: string): void {
    const wrong = keysIn(reason);
    for (const [key, inputs] of this.inputs)
      for (const input of inputs) {
        setAttribute(input, "aria-invalid", wrong.includes(key) ? "true" : "false");
        setAttribute(input, "title", wrong.includes(key) ? reason : "");
      }
  }

  private get form(): Form {
    return {
      name: this.name,
      shape: this.shape.value as ShapeName,
      arm: this.arm.value,
      other: this.other.value,
      values: this.values,
    };
  }
  private reshape(): void {
    this.name = this.shape.value;
    this.build();
    this.write();
  }
  /** An arm has a relative position to another one alone. Where the tip becomes that of the arm that kept it, the two change places. */
  private offerOthers(): void {
    if (this.other.value === this.arm.value) this.other.value = this.tip === this.arm.value ? "" : this.tip;
    this.tip = this.arm.value;
    for (const arm of this.arms)
      this.other.refuse(arm, arm === this.tip ? "Its tip follows the shape: choose another arm." : "");
  }
  private write(): void {
    this.name = editedName(this.name);
    this.offerOthers();
    for (const [key, inputs] of this.inputs)
      this.values.set(
        key,
        inputs.map((input) => input.value.trim()),
      );
    this.draw();
    this.follows(true);
    this.written(yamlOf(this.form));
  }

  private build(): void {
    this.inputs.clear();
    this.fields.replaceChildren(...[...kShapes[this.form.shape], ...kCommon].map((field) => this.fieldOf(field)));
    this.draw();
  }
  private fieldOf({ key, label, unit, initial }: Field): HTMLElement {
    const values = this.values.get(key) ?? initial;
    const inputs = initial.map((_, k) =>
      h("input", {
        type: "text",
        inputmode: "decimal",
        autocomplete: "off",
        "data-key": key,
        "aria-label": `${label}${initial.length > 1 ? ` ${"xyz"[k]}` : ""}${unit === "" ? "" : `, ${unit}`}`,
        oninput: () => this.write(),
      }),
    );
    inputs.forEach((input, k) => {
      input.value = values[k] ?? "";
      input.disabled = this.refused !== "";
    });
    this.inputs.set(key, inputs);
    const title = `${label}${initial.length > 1 ? " x y z" : ""}`;
    return h("div.field", {}, h("span", {}, title), h("div", {}, ...inputs, h("small", {}, unit)));
  }

  /** The path in the plane of its two longest axes, from the start (circle). */
  private draw(): void {
    const path = this.refused === "" ? pathOf(this.form) : [];
    this.picture.replaceChildren();
    if (this.refused !== "") return setText(this.caption, "");
    setText(this.caption, path.length === 0 ? "No picture: a value is not a number." : "");
    if (path.length === 0) return;
    const [a, b] = planeOf(path);
    const range = (k: number): [number, number] => {
      const all = path.map((p) => p[k]!);
      return [Math.min(...all), Math.max(...all)];
    };
    const [[left, right], [bottom, top]] = [range(a), range(b)];
    const scale = (kSize - 2 * kMargin) / Math.max(right - left, top - bottom, 1e-9);
    const at = (p: readonly number[]): string =>
      `${(kMargin + (p[a]! - left) * scale).toFixed(1)},${(kSize - kMargin - (p[b]! - bottom) * scale).toFixed(1)}`;
    const [x = "0", y = "0"] = at(path[0]!).split(",");
    const draw = (name: string, attributes: Record<string, string>): void => {
      const element = document.createElementNS(kSvg, name);
      for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
      this.picture.append(element);
    };
    draw("polyline", { points: path.map(at).join(" "), class: "path" });
    draw("circle", { cx: x, cy: y, r: "4", class: "start" });
    const size = (least: number, most: number): string => Number((most - least).toPrecision(3)).toString();
    setText(this.caption, `→ ${"xyz"[a]}: ${size(left, right)} mm, ↑ ${"xyz"[b]}: ${size(bottom, top)} mm; ○ start`);
  }
}
