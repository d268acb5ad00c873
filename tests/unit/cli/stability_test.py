# SPDX-License-Identifier: Apache-2.0
"""tandem stability compared with tandem fk and with the definition of stability."""
import csv
import io
import json
import math
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import compliant_tubes  # noqa: E402
import system  # noqa: E402


def text(rows):
    return "".join(",".join(repr(value) for value in row) + "\n" for row in rows)


def table(answer):
    return list(csv.DictReader(io.StringIO(answer)))


def fk(rows, *options):
    return table(system.run("fk", "--model", "compliant", *options, text=text(rows)).stdout)


def report(q):
    answer = system.run("stability", "--joints", ",".join(map(repr, q)), "--json")
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)


class Report(unittest.TestCase):
    def test_against_fk(self):
        rng = system.seeded(self)
        step = 1e-4  # the error of the measure is 1e-7
        compared = 0
        for _ in range(4):
            q = compliant_tubes.random_overlap(rng)
            found = report(q)
            row, = fk([q], "--branch")
            self.assertEqual(found["status"], "ok")
            self.assertEqual(found["joints"], q)
            self.assertAlmostEqual(found["stability"], float(row["stability"]), delta=1e-9)
            self.assertAlmostEqual(found["stability_at"], float(row["stability_at"]), delta=1e-9)
            for joint in range(6):
                path = [q] + [[x + k * step * (i == joint) for i, x in enumerate(q)] for k in (1, -1, 0.5, -0.5)]
                near = fk(path, "--follow", "--branch")[1:]
                if any(abs(float(row["stability_at"]) - found["stability_at"]) > 5e-3 for row in near):
                    continue  # the minimum of the determinant is elsewhere within the step: a corner of the measure
                compared += 1
                plus, minus, near_plus, near_minus = (float(row["stability"]) for row in near)
                # Differences of both steps, extrapolated: close to a snap the third derivative is large.
                slope = (8 * (near_plus - near_minus) - (plus - minus)) / (6 * step)
                self.assertAlmostEqual(found["gradient"][joint], slope, delta=1e-3 * abs(slope) + 3e-3,
                                       msg=f"joint {joint + 1} at {q}")
        self.assertGreater(compared, 6)

    def test_equilibria(self):
        rng = system.seeded(self)
        several = 0
        for q in [compliant_tubes.EXTENDED + [0.0, 0.0, 3.14]] + [compliant_tubes.random_overlap(rng)
                                                                  for _ in range(3)]:
            found = report(q)
            listed = found["equilibria"]
            here = listed[found["equilibrium"]]
            self.assertEqual(here["conjugate_points"], 0)
            self.assertAlmostEqual(here["stability"], found["stability"], delta=1e-6)
            self.assertEqual([e["energy"] for e in listed], sorted(e["energy"] for e in listed))
            self.assertEqual(listed[0]["conjugate_points"], 0, "the one of least energy is stable")
            several += len(listed) > 1
            for equilibrium in listed:
                theta = equilibrium["end_angles"]
                alpha, _ = compliant_tubes.from_ends(q[:3], theta)
                for a, b in zip(alpha, q[3:]):
                    self.assertAlmostEqual(a, b, delta=1e-5, msg=f"{q} {equilibrium}")
                self.assertEqual(equilibrium["winding"],
                                 [math.floor((t - theta[0]) / math.tau + 0.5) for t in theta])
        self.assertGreater(several, 0, "one of them has several for sure")

    def test_a_turn_by_the_rotation_left_snaps_and_a_shorter_one_does_not(self):
        rng = system.seeded(self)
        tried = 0
        while tried < 3:
            q = compliant_tubes.EXTENDED + [rng.uniform(-math.pi, math.pi) for _ in range(3)]
            found = report(q)
            if found["rotation_left"] is None or found["rotation_left"] < 0.02:
                continue
            tried += 1
            joint = 2 + found["rotation_tube"]
            for part, snaps in [(-1e-3, False), (1e-3, True)]:
                turn = found["rotation_sense"] * (found["rotation_left"] + part)
                path = [q, [x + turn * (i == joint) for i, x in enumerate(q)]]
                self.assertEqual("snapped" in fk(path, "--follow")[1]["status"], snaps, f"{q}: {found}")

    def test_where_nothing_interacts(self):
        found = report([-0.2, -0.15, -0.1, 0.3, 1.0, -2.0])
        self.assertEqual(found["stability"], 1.0)
        self.assertIsNone(found["rotation_left"])
        self.assertEqual(found["gradient"], [0.0] * 6)
        self.assertEqual(len(found["equilibria"]), 1)
        self.assertEqual(found["equilibria"][0]["end_angles"], [0.3, 1.0, -2.0])

    def test_text_says_the_same(self):
        q = compliant_tubes.EXTENDED + [0.0, 2.0, 1.0]
        found = report(q)
        lines = system.run("stability", "--joints", ",".join(map(repr, q))).stdout.splitlines()
        words = {line.split("  ")[0]: line for line in lines}
        self.assertIn(f"{found['stability']:.6f}", words["stability"])
        self.assertIn(f"{math.degrees(found['rotation_left']):.3f} deg, tube {found['rotation_tube']}",
                      words["rotation to snap"])
        self.assertEqual(sum(line.startswith("  * ") for line in lines), 1)


class Rows(unittest.TestCase):
    def test_rows_are_reports(self):
        rng = system.seeded(self)
        rows = [compliant_tubes.random_overlap(rng) for _ in range(6)]
        answer = system.run("stability", "--csv", "-", "--equilibria", text=text(rows) + "1,2\n0.1,0,0,0,0,0\n")
        self.assertEqual(answer.returncode, 1)
        found = table(answer.stdout)
        self.assertEqual(len(found), len(rows) + 2)
        for q, row in zip(rows, found):
            whole = report(q)
            self.assertEqual(row["status"], "ok")
            self.assertEqual(float(row["stability"]), whole["stability"])
            self.assertEqual([float(row[f"d_{kind}_{i}"]) for kind in ("beta", "alpha") for i in (1, 2, 3)],
                             whole["gradient"])
            self.assertEqual(int(row["stable_equilibria"]) + int(row["other_equilibria"]), len(whole["equilibria"]))
            self.assertEqual(float(row["rotation_left"]), whole["rotation_left"] or math.inf)
        self.assertIn("found 2 numbers", found[-2]["status"])
        self.assertIn("limits", found[-1]["status"])


class Map(unittest.TestCase):
    BETA = ",".join(map(repr, compliant_tubes.EXTENDED))

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def map(self, *options):
        answer = system.run("stability", "--map", *options, timeout=240)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return table(answer.stdout)

    def test_each_place_is_a_cold_start(self):
        rows = self.map("--beta", self.BETA, "--resolution", "9")
        places = [(float(row["relative_2"]), float(row["relative_3"])) for row in rows]
        self.assertEqual(len(set(places)), 81)
        axis = sorted({place[0] for place in places})
        for k, value in enumerate(axis):
            self.assertAlmostEqual(value, math.pi * (k / 4 - 1), delta=1e-12)
        home = math.pi  # alpha_1 of the home position
        alone = fk([compliant_tubes.EXTENDED + [home, home + a, home + b] for a, b in places])
        for row, other in zip(rows, alone):
            self.assertEqual(row["status"], other["status"])
            self.assertEqual(row["stability"], other["stability"])
        self.assertEqual(rows, self.map("--beta", self.BETA, "--resolution", "9", "--threads", "3"))

    def test_end_angles_show_where_stability_is_lost(self):
        rows = self.map("--beta", self.BETA, "--resolution", "13", "--end-angles")
        lost = [row for row in rows if int(row["conjugate_points"]) > 0]
        self.assertTrue(lost)
        self.assertGreater(len(rows), len(lost))
        for row in rows:
            points = int(row["conjugate_points"])
            self.assertEqual(row["status"].startswith("unstable"), points > 0)
            if points == 1:
                self.assertLess(float(row["stability"]), 0.0)
            if points == 0:
                self.assertGreater(float(row["stability"]), 0.0)

    def test_one_axis(self):
        rows = self.map("--beta", self.BETA, "--tubes", "3", "--resolution", "5")
        self.assertEqual([row["relative_3"] for row in rows][2], "0")
        self.assertNotIn("relative_2", rows[0])

    def test_figure(self):
        for options in (["--resolution", "7"], ["--tubes", "2", "--resolution", "7"],
                        ["--resolution", "7", "--end-angles"]):
            picture = self.folder / f"map-{len(options)}.png"
            answer = system.run("stability", "--map", "--beta", self.BETA, "--figure", picture, *options, timeout=240)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            self.assertEqual(answer.stdout, "")
            self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(len(table(picture.with_suffix(".csv").read_text())), 49 if len(options) != 4 else 7)
            picture.unlink()

    def test_wrong_use(self):
        for options, reason in [(["--figure", "x.png"], "--map"), (["--map", "--tubes", "1"], "--tubes"),
                                (["--map", "--tubes", "2,2"], "--tubes"), (["--map", "--tubes", "2.5"], "--tubes"),
                                (["--map", "--csv", "-"], "--csv"), (["--joints", "1,2"], "--joints"),
                                (["--joints", "1,2,3,0,0,0"], "limits"), (["--map", "--beta", "0,0"], "--beta"),
                                (["--arm", "q"], "--arm"), (["--map", "--json", "--figure", "x.png"], "--figure"),
                                (["--map", "--end-angles", "--equilibria"], "--equilibria")]:
            answer = system.run("stability", *options, text="")
            self.assertEqual(answer.returncode, 2, f"{options}: {answer.stderr}")
            self.assertIn(reason, answer.stderr)


if __name__ == "__main__":
    system.main()
