# SPDX-License-Identifier: Apache-2.0
"""tandem experiment --offline: statistics of the table, JSON and CSV, and what docs/reproduction.md states of them."""
import csv
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

PAGE = system.SOURCE / "docs" / "reproduction.md"
QP = ("nspqp", "snsqp")


def numbers(line):
    return [float(x) for x in re.findall(r"\d+(?:\.\d+)?", line)]


class Experiment(system.SystemTest):
    def experiment(self, *options):
        return self.assert_ok(system.run("experiment", *options, "--offline", timeout=100)).stdout

    def rows(self, *options):
        return json.loads(self.experiment(*options, "--json"))["rows"]

    def test_mean_standard_deviation_and_rms_belong_together(self):
        rows = self.rows("table3", "--by-configuration", "--csv", self.folder)
        with open(self.folder / "summary.csv", newline="", encoding="utf-8") as file:
            summary = {(r["trajectory"], r["method"], r["configuration"]): r for r in csv.DictReader(file)}
        for row in rows:
            self.assertEqual([run["configuration"] for run in row["configurations"]], ["1", "2", "3"])
            for key, column in (("epsilon_ab", "ab"), ("epsilon_a", "a")):
                for name in ("mean_mm", "rms_mm", "std_mm", "max_mm"):
                    mean = sum(run[key][name] for run in row["configurations"]) / 3
                    self.assertAlmostEqual(row[key][name], mean, delta=1e-12)
                for run in row["configurations"]:
                    e = run[key]
                    self.assertAlmostEqual(e["rms_mm"] ** 2, e["mean_mm"] ** 2 + e["std_mm"] ** 2, delta=1e-12)
                    line = summary[row["trajectory"], row["method"], run["configuration"]]
                    for name in ("mean", "rms", "std", "max"):
                        self.assertEqual(float(line[f"{name}_{column}"]), e[f"{name}_mm"])
                self.assertLessEqual(row[key]["std_mm"], row[key]["rms_mm"])
                self.assertLessEqual(row[key]["std_mm"], row[key]["max_mm"] / 2)

    def test_published_rows_cannot_be_what_they_are_called(self):
        # Rounded to 0.01: half of that is allowed on either side.
        half = 0.005
        published = [(row["trajectory"], row["method"], row["published"]["epsilon_ab"])
                     for row in self.rows("table3", "--only", "-1-") if row["method"] in QP]
        self.assertEqual(len(published), 4)
        as_mean = []
        for trajectory, method, e in published:
            self.assertNotIn("mean_mm", e)
            self.assertGreater(e["std_mm"], e["rms_mm"])
            self.assertGreaterEqual(e["std_mm"] - half, e["rms_mm"] + half - 1e-9)
            if e["std_mm"] - half <= (e["max_mm"] + half) / 2:
                as_mean.append((trajectory, method))
        self.assertEqual(as_mean, [("rectangle", "snsqp"), ("lissajous", "nspqp")])

    def test_the_page_has_the_table_that_the_command_prints(self):
        printed = self.experiment("table3", "--by-configuration").splitlines()[:-1]
        block = next(b for b in PAGE.read_text(encoding="utf-8").split("```") if "configuration 1  " in b)
        page = block.strip("\n").splitlines()
        self.assertEqual(len(page), len(printed))
        delta = 0.0
        for shown, line in zip(page, printed):
            if not line.startswith(" "):
                delta = 0.05 if " snsqp" in line else 0.002  # other processors round differently, which snsqp amplifies
            self.assertEqual(re.sub(r"[\d.\s]+", " ", shown).strip(), re.sub(r"[\d.\s]+", " ", line).strip())
            for wanted, found in zip(numbers(shown), numbers(line), strict=True):
                self.assertAlmostEqual(found, wanted, delta=delta + 0.01 * wanted, msg=line)

    def test_without_the_gate_only_nspwln_leaves_its_limits(self):
        refused = system.run("experiment", "table3", "--gate", "off")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--gate off: expected --offline", refused.stderr)
        answer = system.run("experiment", "table3", "--offline", "--gate", "off", "--by-configuration", "--json", "--csv", self.folder)
        self.assertEqual(answer.returncode, 1, "setpoints left their limits")
        answer = json.loads(answer.stdout)
        self.assertEqual(answer["gate"], "off")
        excess = {}
        for row in answer["rows"]:
            for run in row["configurations"]:
                self.assertEqual(run["limit_violations"] > 0, run["largest_excess_mm"] > 0)
                if run["largest_excess_mm"] > 0:
                    excess[row["trajectory"], row["method"], run["configuration"]] = run["largest_excess_mm"]
        wanted = {("lissajous", "nspwln", "1"): 3.821, ("lissajous", "nspwln", "2"): 0.866,
                  ("lissajous", "nspwln-joint", "1"): 5.665, ("lissajous", "nspwln-joint", "2"): 0.427}
        self.assertEqual(set(excess), set(wanted))
        for key, value in wanted.items():
            self.assertAlmostEqual(excess[key], value, delta=0.01, msg=str(key))
            self.assertIn(f"{value:.3f}", PAGE.read_text(encoding="utf-8"))
        with open(self.folder / "summary.csv", newline="", encoding="utf-8") as file:
            self.assertEqual({row["gate"] for row in csv.DictReader(file)}, {"off"})

    def test_larger_trajectories_come_near_the_published_iterations(self):
        for row in self.rows("table3-large"):
            self.assertEqual(row["converged"], row["points"])
            if "published" in row:
                ratio = row["iterations"] / row["published"]["iterations"]
                self.assertAlmostEqual(ratio, 1.0, delta=0.06, msg=f"{row['trajectory']} {row['method']}")


if __name__ == "__main__":
    system.main()
