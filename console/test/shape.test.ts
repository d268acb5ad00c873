// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Form } from "../src/state/shape";
import { editedName, formOf, keysIn, kShapeNames, kShapes, pathOf, planeOf, yamlOf } from "../src/state/shape";
import { seeded } from "./random";

const form = (shape: Form["shape"], values: Record<string, string[]> = {}): Form => ({
  name: "made",
  shape,
  arm: "arm_a",
  other: "arm_b",
  values: new Map(Object.entries(values)),
});

test("the file of a form has what was typed, with the units of its keys", () => {
  expect(yamlOf(form("circle", { center_offset_mm: ["0", "12.5", "0"], points: ["many"] }))).toBe(
    `tandem: trajectory/1
name: made
tasks:
  - relative: [arm_a, arm_b]
  - tip: arm_a
shape:
  circle:
    center_offset_mm: [0, 12.5, 0]
    normal: [0, 0, 1]
    turns: 1
points: "many"
speed_mm_per_s: 2
acceleration_mm_per_s2: 5
tolerance_mm: 0.88
following: timed
max_iterations: 1000
`,
  );
  expect(yamlOf({ ...form("line"), other: "" })).not.toContain("relative");
});

test("what is no number is one quoted text: no comma makes two values of it, and no empty field none", () => {
  const yaml = yamlOf(form("line", { displacement_mm: ["0", "1,5", ""], speed_mm_per_s: ["1,5"], points: [""] }));
  expect(yaml).toContain('displacement_mm: [0, "1,5", ""]\n');
  expect(yaml).toContain('speed_mm_per_s: "1,5"\n');
  expect(yaml).toContain('points: ""\n');
  for (const typed of ["5] # ", 'a"b', "1: 2", "~", "0x10", "1e", "."])
    expect(yamlOf(form("line", { points: [typed] }))).toContain(`points: ${JSON.stringify(typed)}\n`);
  for (const typed of ["5", "-5", "+5.25", ".5", "5.", "1e-3", "2.5E+3"])
    expect(yamlOf(form("line", { points: [typed] }))).toContain(`points: ${typed}\n`);
  expect(pathOf(form("line", { displacement_mm: ["0", "", "0"] }))).toEqual([]); // an empty field is no zero
});

test("an edited trajectory has another name than the served one, however often it is edited", () => {
  expect(editedName("circle")).toBe("circle-edited");
  expect(editedName(editedName("circle"))).toBe("circle-edited");
});

test("the picture's path starts at zero, and is the shape that was typed", () => {
  const random = seeded();
  const dice = (): number[] => [0, 1, 2].map(() => 20 * random() - 10);
  const text = (v: number[]): string[] => v.map(String);
  for (let round = 0; round < 50; ++round) {
    const [a, b] = [dice(), dice()];
    expect(pathOf(form("line", { displacement_mm: text(a) }))).toEqual([[0, 0, 0], a]);
    const rectangle = pathOf(form("rectangle", { first_mm: text(a), second_mm: text(b) }));
    expect(rectangle.at(-1)).toEqual([0, 0, 0]);
    expect(rectangle[2]).toEqual(a.map((x, k) => x + b[k]!));
    const circle = pathOf(form("circle", { center_offset_mm: text(a), normal: text(b), turns: ["1"] }));
    for (const p of circle) {
      expect(Math.hypot(...p.map((x, k) => x - a[k]!))).toBeCloseTo(Math.hypot(...a), 6);
      expect(p.reduce((sum, x, k) => sum + x * b[k]!, 0)).toBeCloseTo(0, 6);
    }
    expect(Math.hypot(...circle[0]!)).toBeCloseTo(0, 9);
    expect(Math.hypot(...circle.at(-1)!)).toBeCloseTo(0, 9);
    const sines = pathOf(form("lissajous", { amplitude_mm: text(a), phase_deg: text(b) }));
    expect(Math.hypot(...sines[0]!)).toBeCloseTo(0, 9);
  }
  for (const shape of kShapeNames)
    expect(pathOf(form(shape, { [kShapes[shape][0].key]: ["0", "x", "0"] }))).toEqual([]);
  expect(planeOf(pathOf(form("lissajous")))).toEqual([1, 2]);
  expect(planeOf(pathOf(form("circle")))).toEqual([0, 1]);
});

test("a reason of the parser names the fields that are wrong", () => {
  expect(keysIn("line 7: points: found 'many', expected an integer")).toEqual(["points"]);
  expect(keysIn("shape.circle.center_offset_mm: found 2 numbers")).toEqual(["center_offset_mm"]);
  expect(keysIn("planning is busy")).toEqual([]);
});

test("a served trajectory fills the form, if the form has its shape", () => {
  const spec = {
    arm: 1,
    other_arm: -1,
    timed: true,
    moving: false,
    further: [],
    values: { max_iterations: 700, points: 50, speed: 0.002, acceleration: 0.005, tolerance: 0.00088 },
    shape: { lissajous: { amplitude: [0, 0.01, 0.02], cycles: [0, 1, 2], phase: [0, Math.PI / 2, 0] } },
  };
  const made = formOf("eight", spec, ["left", "right"]) as Form;
  expect(made).toMatchObject({ name: "eight", shape: "lissajous", arm: "right", other: "" });
  expect(Object.fromEntries(made.values)).toEqual({
    amplitude_mm: ["0", "10", "20"],
    cycles: ["0", "1", "2"],
    phase_deg: ["0", "90", "0"],
    points: ["50"],
    speed_mm_per_s: ["2"],
    acceleration_mm_per_s2: ["5"],
    tolerance_mm: ["0.88"],
    max_iterations: ["700"],
  });
  expect(yamlOf(made)).toContain("\nmax_iterations: 700\n"); // there is no field for it, and it is not lost
  expect(formOf("w", { ...spec, shape: {} }, ["left"])).toBe("its shape is none of line, rectangle, circle, lissajous");
  expect(formOf("w", { ...spec, timed: false }, ["left"])).toBe("it goes from point to point, not by time");
  expect(formOf("w", { ...spec, moving: true }, ["left"])).toBe("its relative position moves");
  const tasks = ["remote_centre", "joint_limits"];
  expect(formOf("w", { ...spec, further: tasks }, ["left"])).toBe(
    "it has tasks for which there is no field: remote_centre, joint_limits",
  );
});
