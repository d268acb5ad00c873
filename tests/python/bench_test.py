# SPDX-License-Identifier: Apache-2.0
"""What deploy/bench.sh makes of its results: small benchmarks, their table, their figures; Python and C++ answer alike.

The first argument is the folder of the executables of a build tree."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
BENCH = pathlib.Path(__file__).resolve().parents[2] / "bench"


def run(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True, timeout=120).stdout


class Benchmarks(unittest.TestCase):
    def test_table_and_figures(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            run(BIN / "bench_cycle", "--benchmark_filter=tubes/tip/rigid|cycle/.*qp/rigid/active-set/warm",
                f"--benchmark_out={folder}/bench_cycle.json", "--benchmark_out_format=json")
            # Ends with 1 where Python and C++ give different numbers.
            run(sys.executable, BENCH / "batch.py", BIN, "--sizes", 1, 100, "--output", folder / "batch.json")
            text = run(sys.executable, BENCH / "report.py", folder, "--figures", folder)
            for words in ("snsqp", "nspqp", "4 tubes", "Python / C++", " cores, Linux "):
                self.assertIn(words, text)
            self.assertIn("| nspqp | rigid | active-set | warm |", run(sys.executable, BENCH / "report.py", folder, "--markdown"))
            for figure in ("performance-scaling.png", "performance-cycle.png"):
                self.assertGreater((folder / figure).stat().st_size, 10000)
            everything = json.loads((folder / "bench.json").read_text())
            self.assertEqual(set(everything["results"]), {"bench_cycle", "batch"})
            runs = {r["name"].split("/iterations")[0]: r for r in everything["results"]["bench_cycle"]["benchmarks"]}
            for name, run_of_it in runs.items():
                self.assertEqual(run_of_it["failed"], 0, name)
                self.assertLessEqual(run_of_it["p50"], run_of_it["p99"], name)
            self.assertLess(runs["tubes/tip/rigid/cold/2"]["p50"], runs["tubes/tip/rigid/cold/4"]["p50"])

    def test_monte_carlo_a_second(self):
        sys.path.insert(0, str(BENCH))
        import simulation  # pylint: disable=import-outside-toplevel,import-error
        with tempfile.TemporaryDirectory() as name:
            rows = [simulation.montecarlo(BIN / "tandem", "hqp", jobs, tasks=10, times=1) for jobs in (1, 2)]
            pathlib.Path(name, "simulation.json").write_text(json.dumps({"montecarlo": rows}))
            for row in rows:
                self.assertEqual((row["succeeded"], row["feasible"]), (9, 9))
                self.assertAlmostEqual(row["tasks_per_s"] * row["seconds"], 10)
            self.assertRegex(run(sys.executable, BENCH / "report.py", name, "--markdown"), r"\| hqp \| 2 \| 10 \| .* \| 9 of 9 \|")


if __name__ == "__main__":
    unittest.main(verbosity=2)
