# SPDX-License-Identifier: Apache-2.0
"""tandem montecarlo: equal rows for any number of threads and shards, merging, tables, figures, refusals."""
import csv
import json
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

FEW = ("--tasks", 12, "--seed", 5, "--methods", "nspqp,hqp")


class MonteCarlo(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def montecarlo(self, *options, code=0):
        answer = system.run("montecarlo", *options, timeout=240)
        self.assertEqual(answer.returncode, code, answer.stderr)
        return answer

    def file(self, name, *options):
        path = self.folder / name
        self.montecarlo(*options, "--csv", path)
        return path.read_text()

    def test_rows_do_not_depend_on_threads_and_shards(self):
        sweep = (*FEW, "--curvature-error", "0,3%", "--tip-noise-mm", "0.05")
        whole = self.file("all.csv", *sweep, "--jobs", 1)
        self.assertEqual(self.file("threads.csv", *sweep, "--jobs", 4), whole)
        shards = []
        for i in range(3):
            self.file(f"{i}.csv", *sweep, "--shard", f"{i}/3")
            shards.append(self.folder / f"{i}.csv")
        merged = self.file("merged.csv", "merge", *shards)
        self.assertEqual(merged, whole)
        other = [6 if word == 5 else word for word in sweep]
        self.assertNotEqual(self.file("other.csv", *other), whole)
        missing = self.montecarlo("merge", *shards[:2], code=2)
        self.assertIn("is missing, expected tasks 0 to 11", missing.stderr)
        twice = self.montecarlo("merge", *shards, shards[0], code=2)
        self.assertIn("is present twice", twice.stderr)

    def test_json_counts_the_rows(self):
        found = json.loads(self.montecarlo(*FEW, "--csv", self.folder / "all.csv", "--json").stdout)
        with open(self.folder / "all.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([line["method"] for line in found], ["nspqp", "hqp"])
        for line in found:
            mine = [row for row in rows if row["method"] == line["method"]]
            self.assertEqual(len(mine), 12)
            self.assertEqual(line["feasible"], sum(row["feasible"] == "1" for row in mine))
            self.assertEqual(line["succeeded"], sum(row["succeeded"] == row["feasible"] == "1" for row in mine))
            self.assertEqual(line["limit_violations"], 0)
            self.assertEqual(line["infeasible_reported"], line["infeasible"])
            self.assertGreater(line["infeasible"], 0)
            self.assertTrue(all(row["outcome"] != "completed" for row in mine if row["feasible"] == "0"))

    def test_errors_of_the_plant_change_what_happens(self):
        def errors(*options):
            return json.loads(self.montecarlo(*FEW, *options, "--json").stdout)[0]["rms_a_mm"]["p50"]

        self.assertGreater(errors("--curvature-error", "10%", "--feedback", "model"), 2.0)
        self.assertLess(errors("--curvature-error", "10%"), 0.88)

    def test_tolerance_of_the_run_speed_and_intervals(self):
        whole = self.file("plain.csv", *FEW)
        self.assertEqual(self.file("same.csv", *FEW, "--stop-within-mm", "0"), whole)
        answer = self.montecarlo(*FEW, "--stop-within-mm", "0,0.2", "--speed-mm-per-s", "0,1", "--json")
        found = json.loads(answer.stdout)
        self.assertEqual(len(found), 6)
        plain, inside, timed = found[0], found[2], found[4]
        self.assertLess(inside["rms_a_mm"]["p99"], 0.2)
        self.assertGreater(plain["rms_a_mm"]["p50"], 0.5)
        self.assertEqual(timed["errors"]["speed-mm-per-s"], 1)
        self.assertLess(timed["rest_a_mm"]["p50"], 0.01)
        self.assertLessEqual(timed["rms_a_mm"]["p50"], timed["max_a_mm"]["p50"])
        self.assertNotIn("max_a_mm", plain)
        for line in found:
            lower, upper = line["success_interval_95"]
            self.assertLess(lower, line["succeeded"] / line["feasible"] + 1e-9)
            self.assertGreater(upper, line["succeeded"] / line["feasible"] - 1e-9)
        self.assertEqual(plain["against"]["method"], "hqp")
        self.assertNotIn("against", found[1])
        table = self.montecarlo("merge", self.folder / "plain.csv").stdout
        self.assertRegex(table, r"hqp against nspqp, tasks that one alone completed: \d+ : \d+, p = ")
        self.assertIn("95 % interval", table)

    def test_figure(self):
        self.montecarlo(*FEW, "--tip-noise-mm", "0,0.3", "--figure", self.folder / "mc.png")
        self.assertEqual((self.folder / "mc.png").read_bytes()[:4], b"\x89PNG")
        self.assertTrue((self.folder / "mc.csv").exists())

    def test_refusals(self):
        for options, text in (
            (("--methods", "nspqp,best"), "--methods: found 'best', expected different ones of nsp, "),
            (("--curvature-error", "much"), "--curvature-error: found 'much', expected a share such as 0.05 or 5%"),
            (("--curvature-error", "5%,5%"), "--curvature-error: found '5%' twice"),
            (("--tip-noise-mm=-1",), "--tip-noise-mm: found '-1', expected a number, not below zero"),
            (("--stop-within-mm", "0.9"), "--stop-within-mm: found '0.9', expected at most 0.88, the threshold of success"),
            (("--shard", "3/3"), "--shard: found '3/3', expected i/n with i from 0 to n-1"),
            (("--feedback", "eyes"), "--feedback: found 'eyes', expected model or sensor"),
            (("--set", "gain=1"), "--set: found 'gain=1', expected NAME=VALUE with one of "),
        ):
            self.assertIn(text, self.montecarlo(*options, "--tasks", 1, code=2).stderr)
        bad = self.folder / "bad.csv"
        bad.write_text("a,b\n1,2\n")
        self.assertIn(f"{bad}:1: found 'a,b', expected the header", self.montecarlo("merge", bad, code=2).stderr)


if __name__ == "__main__":
    system.main()
