# SPDX-License-Identifier: Apache-2.0
"""tandem show: its numbers against closed forms, the paper's kinematics and other commands; its pictures."""
import json
import math
import pathlib
import re
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

PRESETS = pathlib.Path(__file__).resolve().parents[3] / "config" / "presets"


class Show(system.SystemTest):
    def shown(self, *words):
        return json.loads(self.assert_ok(system.run("show", *words, "--json")).stdout)

    def test_arms_at_home(self):
        facts = self.shown("ark2024")
        self.assertEqual((facts["kind"], facts["robot"]), ("robot", "ark2024"))
        homes = re.findall(r"home: \{beta_mm: \[(.*?)\], alpha_deg: \[(.*?)\]", (PRESETS / "robots" / "ark2024.yaml").read_text())
        self.assertEqual(len(homes), 2)
        for arm, letter, home in zip(facts["arms"], "ab", homes):
            beta, alpha = ([float(x) for x in text.split(",")] for text in home)
            q = [1e-3 * x for x in beta] + [math.radians(x) for x in alpha]
            expected = tubes.position(tubes.transform(q, letter))
            self.assertLess(tubes.norm(tubes.minus(arm["tip_m"], expected)), 1e-9)
            self.assertLess(tubes.norm(tubes.minus(arm["shape_m"][-1], expected)), 1e-9)
            lower, upper = arm["reach"]["z_m"]
            self.assertTrue(lower < expected[2] - arm["base"][2] < upper)
            self.assertLess(math.dist(expected[:2], arm["base"][:2]), arm["reach"]["radius_m"])
            # No point is farther away than the tubes are long.
            self.assertLess(upper, max(arm["tube_lengths_m"]))
        pair, = facts["clearance"]
        overlap = re.search(r"overlap by ([0-9.]+) mm", self.assert_ok(system.run("validate", "ark2024")).stdout)[1]
        self.assertAlmostEqual(-1e3 * pair["distance_m"], float(overlap), delta=5e-4)

    def test_the_reach_is_that_of_workspace(self):
        reach = self.shown("ark2024")["arms"][0]["reach"]
        answer = system.run("workspace", "--model", "rigid", "--samples", 1 << 16, "--arm", "a", "--json")
        arm, = json.loads(self.assert_ok(answer).stdout)["arms"]
        self.assertAlmostEqual(reach["radius_m"], arm["radius_m"], delta=0.03 * arm["radius_m"])
        for mine, other in zip(reach["z_m"], arm["z_m"]):
            self.assertAlmostEqual(mine, other, delta=0.01)

    def test_paths(self):
        circle, = self.shown("circle")["paths"]
        self.assertAlmostEqual(circle["length_m"], 2 * math.pi * 0.01, delta=1e-4)
        # 2 mm/s, 5 mm/s^2: both ramps together take v / a longer than their way at full speed.
        self.assertAlmostEqual(circle["duration_s"], circle["length_m"] / 2e-3 + 2e-3 / 5e-3, delta=1e-9)
        self.assertLess(tubes.norm(tubes.minus(circle["path_m"][0], [0, 0, 0])), 1e-12)
        placed = self.shown("circle", "--robot", "ark2024")
        self.assertLess(tubes.norm(tubes.minus(placed["paths"][0]["path_m"][0], placed["arms"][0]["tip_m"])), 1e-12)
        lift, = self.shown("lift")["paths"]
        self.assertAlmostEqual(lift["length_m"], 6e-3, delta=1e-6)
        table = self.shown("table3")
        self.assertEqual(table["paths"][0]["most_iterations_per_point"], 100)
        self.assertAlmostEqual(table["paths"][0]["length_m"], 0.08, delta=1e-9)
        start = table["paths"][0]["path_m"][0]
        self.assertLess(tubes.norm(tubes.minus(start, table["arms"][0]["tip_m"])), 1e-12)

    def test_what_has_no_picture(self):
        for file in ("ark2024-two-buses", "epos4"):
            self.assertIn("drives have no picture", self.assert_fails(2, "show", file).stderr)
        self.assertIn("found neither a file nor a preset", self.assert_fails(2, "show", "nothing").stderr)
        self.assertIn("ablation-pair", self.assert_fails(2, "show", "circle", "--robot", "ablation-pair").stderr)
        self.assertIn("right", self.assert_fails(2, "show", self.named("right"), "--robot", "ark2024").stderr)

    def named(self, name):
        file = self.folder / "named.yaml"
        file.write_text((PRESETS / "trajectories" / "circle-one-arm.yaml").read_text().replace("tip: a", f"tip: {name}"))
        return file

    def assert_fails(self, code, *words):
        answer = system.run(*words)
        self.assertEqual(answer.returncode, code, answer.stdout + answer.stderr)
        return answer

    def test_all_presets_that_can_be_drawn(self):
        for file in sorted(PRESETS.glob("*/*.yaml")):
            if file.parent.name not in ("hardware", "drives"):
                with self.subTest(file.name):
                    insertion = file.parent.name == "trajectories" and "insertion:" in file.read_text()
                    if insertion:
                        self.assertIn("expected --robot NAME", self.assert_fails(2, "show", file).stderr)
                    text = self.assert_ok(system.run("show", file, *(["--robot", "ark2024"] if insertion else []))).stdout
                    self.assertTrue("tip at" in text or "path " in text, text)

    def test_pictures(self):
        for words, width in ((["laptop"], 1417), (["circle", "--width", "1"], 692), (["planar-pair"], 1417),
                             (["ablation-pair"], 1417), (["table3", "--width", "1"], 692)):
            file = self.folder / "picture.png"
            self.assert_ok(system.run("show", *words, "--figure", file))
            self.assertEqual(struct.unpack(">I", file.read_bytes()[16:20])[0], width)
        self.assertIn("picture.pdf", self.assert_ok(system.run("show", "ark2024", "--figure", self.folder / "picture.pdf")).stderr)


if __name__ == "__main__":
    system.main()
