// SPDX-License-Identifier: Apache-2.0
/** A trajectory as a form: its keys with what was typed, the file that results, and the path for a picture. Only planning's parser judges the
 * values: they are copied as typed. */
import type { TrajectorySpec } from "./robot";

export interface Field {
  /** In the file; it names the unit. */
  key: string;
  label: string;
  unit: string;
  initial: readonly string[];
}

const vector = (key: string, label: string, unit: string, ...initial: string[]): Field => ({
  key,
  label,
  unit,
  initial,
});

/** Keys of each shape, as in config/trajectory_table.cpp. */
export const kShapes = {
  line: [vector("displacement_mm", "from start to end", "mm", "0", "20", "0")],
  rectangle: [
    vector("first_mm", "first side", "mm", "0", "20", "0"),
    vector("second_mm", "second side", "mm", "-20", "0", "0"),
  ],
  circle: [
    vector("center_offset_mm", "from start to centre", "mm", "0", "10", "0"),
    vector("normal", "normal of its plane", "", "0", "0", "1"),
    vector("turns", "turns", "", "1"),
  ],
  lissajous: [
    vector("amplitude_mm", "amplitude", "mm", "0", "10", "10"),
    vector("cycles", "cycles", "", "0", "1", "2"),
    vector("phase_deg", "phase", "deg", "0", "0", "0"),
  ],
} as const satisfies Record<string, readonly Field[]>;
export type ShapeName = keyof typeof kShapes;
export const kShapeNames = Object.keys(kShapes) as ShapeName[];

/** Keys of all trajectories. */
export const kCommon: readonly Field[] = [
  vector("points", "points", "", "100"),
  vector("speed_mm_per_s", "speed", "mm/s", "2"),
  vector("acceleration_mm_per_s2", "acceleration", "mm/s²", "5"),
  vector("tolerance_mm", "tolerance", "mm", "0.88"),
];

/** It is kept as it is served: the form has no field for it. */
const kMostSteps = vector("max_iterations", "", "", "1000");

export interface Form {
  name: string;
  shape: ShapeName;
  /** Whose tip follows the shape. */
  arm: string;
  /** Whose tip keeps its position relative to the first; empty: none. */
  other: string;
  /** What was typed, by key. */
  values: ReadonlyMap<string, readonly string[]>;
}

const valuesOf = (form: Form, { key, initial }: Field): readonly string[] => form.values.get(key) ?? initial;

const kEdited = "-edited";
/** The name of a trajectory that the operator has changed: reports of its run do not have the name of a served one. */
export const editedName = (name: string): string => (name.endsWith(kEdited) ? name : name + kEdited);

const kNumber = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
/** What was typed, as one YAML value: "1,5" in a list would be two numbers, and an empty field none. The parser says of a text which key has it,
 * and what is expected there. */
const scalar = (typed: string): string => (kNumber.test(typed) ? typed : JSON.stringify(typed));

/** The trajectory file. */
export function yamlOf(form: Form): string {
  const line = (field: Field): string => {
    const values = valuesOf(form, field).map(scalar);
    return `${field.key}: ${field.initial.length > 1 ? `[${values.join(", ")}]` : values[0]}`;
  };
  const tasks = [...(form.other === "" ? [] : [`relative: [${form.arm}, ${form.other}]`]), `tip: ${form.arm}`];
  return [
    "tandem: trajectory/1",
    `name: ${form.name}`,
    "tasks:",
    ...tasks.map((task) => `  - ${task}`),
    "shape:",
    `  ${form.shape}:`,
    ...kShapes[form.shape].map((field) => `    ${line(field)}`),
    ...kCommon.map(line),
    "following: timed",
    line(kMostSteps),
    "",
  ].join("\n");
}

/** Keys that a reason of the parser names. */
export const keysIn = (reason: string): string[] =>
  [...kShapeNames.flatMap((name): readonly Field[] => kShapes[name]), ...kCommon]
    .map(({ key }) => key)
    .filter((key) => new RegExp(`\\b${key}\\b`).test(reason));

const kSteps = 120;

/** Points of the path, mm, from the start at zero; empty if a value is not a number. */
export function pathOf(form: Form): number[][] {
  const numbers = kShapes[form.shape].map((field) =>
    valuesOf(form, field).map((typed) => (kNumber.test(typed) ? Number(typed) : NaN)),
  );
  if (!numbers.flat().every(Number.isFinite)) return [];
  const [a = [], b = [], c = []] = numbers;
  const zero = [0, 0, 0];
  const along = (at: (t: number) => number[]): number[][] =>
    Array.from({ length: kSteps + 1 }, (_, k) => at(k / kSteps));
  switch (form.shape) {
    case "line":
      return [zero, a];
    case "rectangle":
      return [zero, a, a.map((x, k) => x + b[k]!), b, zero];
    case "circle":
      return along((t) => rotated(a, b, 2 * Math.PI * t * c[0]!));
    case "lissajous": {
      const phase = c.map((degrees) => (degrees * Math.PI) / 180);
      return along((t) =>
        a.map((size, k) => size * (Math.sin(2 * Math.PI * b[k]! * t + phase[k]!) - Math.sin(phase[k]!))),
      );
    }
  }
}

/** The start after a rotation about a centre. */
function rotated(centre: readonly number[], normal: readonly number[], angle: number): number[] {
  const length = Math.hypot(...normal) || 1;
  const n = normal.map((x) => x / length);
  const r = centre.map((x) => -x);
  const along = n.reduce((sum, x, k) => sum + x * r[k]!, 0);
  const across = [0, 1, 2].map((k) => n[(k + 1) % 3]! * r[(k + 2) % 3]! - n[(k + 2) % 3]! * r[(k + 1) % 3]!);
  return [0, 1, 2].map(
    (k) => centre[k]! + Math.cos(angle) * r[k]! + Math.sin(angle) * across[k]! + (1 - Math.cos(angle)) * along * n[k]!,
  );
}

/** The two axes along which a path is longest, in order. */
export function planeOf(path: readonly (readonly number[])[]): [number, number] {
  const extent = [0, 1, 2].map((k) => Math.max(...path.map((p) => p[k]!)) - Math.min(...path.map((p) => p[k]!)));
  const least = extent.lastIndexOf(Math.min(...extent));
  const [a = 0, b = 1] = [0, 1, 2].filter((k) => k !== least);
  return [a, b];
}

/** A form with the values of a served trajectory; a reason if it has what the form would lose.
 * @param arms  names, in the robot's order */
export function formOf(name: string, spec: TrajectorySpec, arms: readonly string[]): Form | string {
  const shape = kShapeNames.find((one) => spec.shape[one]);
  if (spec.further.length > 0) return `it has tasks for which there is no field: ${spec.further.join(", ")}`;
  if (!shape) return `its shape is none of ${kShapeNames.join(", ")}`;
  if (!spec.timed) return "it goes from point to point, not by time";
  if (spec.moving) return "its relative position moves";
  const values = new Map<string, readonly string[]>();
  const put = (field: Field, si: Record<string, number | number[]>): void => {
    const [key, factor] = unitsOf(field);
    const value = si[key];
    if (value !== undefined)
      values.set(
        field.key,
        [value].flat().map((x) => String(Number((x * factor).toPrecision(9)))),
      );
  };
  for (const field of kShapes[shape]) put(field, spec.shape[shape]!);
  for (const field of [...kCommon, kMostSteps]) put(field, spec.values);
  return { name, shape, arm: arms[spec.arm] ?? "", other: arms[spec.other_arm] ?? "", values };
}

/** Key without unit, and factor from the SI unit. */
function unitsOf({ key, unit }: Field): [string, number] {
  const factor = unit.startsWith("mm") ? 1000 : unit === "deg" ? 180 / Math.PI : 1;
  return [key.replace(/_(mm|deg)(_per_s2?)?$/, ""), factor];
}
