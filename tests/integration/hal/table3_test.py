# SPDX-License-Identifier: Apache-2.0
"""Table 3 with tandem-hal and two buses of simulated drives instead of the simulator.

Configuration 2 with both trajectories and every method: the paper's shapes and distances between points, a twelfth of their length.
TANDEM_ONLY=rectangle-1 (or any part of a run's name) runs the whole experiment's runs of that name."""
import collections
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import HalTest, favour, system  # noqa: E402

METHODS = ["nspwln", "nspwln-joint", "nspqp", "snsqp"]
TOLERANCE_MM = 0.88


class Table3(HalTest):
    def setUp(self):
        super().setUp()
        self.experiment = system.short_experiment(self.folder, *METHODS)
        for bus in "ab":
            self.drive_sim(bus)

    def run_experiment(self, name, *options, timeout):
        words = [system.executable(), "experiment", *map(str, options), "--csv", str(self.folder / name), "--json"]
        # A virtual machine may pause for seconds while its host is busy, and lose the sample that decides on a point: one repetition there,
        # and only for that error.
        tries = 2 if os.environ.get("TANDEM_CAN") else 1
        for left in reversed(range(tries)):
            process = favour(subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                              start_new_session=True))
            self.addCleanup(system.reap, process)
            output, errors = process.communicate(timeout=timeout)
            slow = r"did not answer|not running or not connected|\b(\d+)/(?!\1\b)\d+ points"
            if process.returncode == 0 or left == 0 or not re.search(slow, errors):
                break
            print(f"once more: {errors.strip().splitlines()[-1]}", flush=True)
        self.assertEqual(process.returncode, 0, output + errors)
        with open(self.folder / name / "summary.csv", newline="", encoding="utf-8") as file:
            return {f"{row['trajectory']}-{row['configuration']}-{row['method']}": row for row in csv.DictReader(file)}

    def test_every_run_converges_as_in_simulation(self):
        only = os.environ.get("TANDEM_ONLY")
        words = ["table3", "--only", only] if only else [self.experiment]
        limit = 3600 if only else 110
        begin = time.monotonic()
        wanted = self.run_experiment("offline", *words, "--offline", timeout=limit)
        path = self.deployment()
        found = self.run_experiment("hal", *words, "--deployment", path, timeout=limit)
        self.assertEqual(set(found), set(wanted))
        print(f"{len(found)} runs in {time.monotonic() - begin:.0f} s; iterations, largest errors in mm: "
              "hal (tandem-sim in lock-step)")
        for name, row in found.items():
            sim = wanted[name]
            print(f"  {name:24} {row['iterations']:>4} ({sim['iterations']:>4})   relative {float(row['max_ab']):.3f} "
                  f"({float(sim['max_ab']):.3f})   tip {float(row['max_a']):.3f} ({float(sim['max_a']):.3f})   "
                  f"gate {row['gate_actions']} ({sim['gate_actions']})", flush=True)
        for name, row in found.items():
            self.assertEqual((row["converged"], row["limit_violations"]), (row["points"], "0"), name)
            self.assertLessEqual(max(float(row["max_ab"]), float(row["max_a"])), TOLERANCE_MM, name)
            # In real time a point is evaluated during the following step: with tandem-sim, too, it takes up to one iteration more per point
            # than in lock-step. The numbers of a delayed virtual machine are not compared.
            steps = int(wanted[name]["iterations"])
            if not os.environ.get("TANDEM_CAN"):
                self.assertLessEqual(int(row["iterations"]), steps + int(row["points"]), name)
                self.assertGreaterEqual(int(row["iterations"]), steps - 2, name)
        self.assert_limits_kept()
        self.assertGreater(min(drive["travel"] for bus in "ab" for drive in self.drives(bus)), 0)

    def test_the_bus_carries_what_the_calculator_says(self):
        running = self.start_hal()
        self.await_ready(running)
        budget = json.loads(self.assert_ok(system.run("can", "budget", self.hardware, "--json")).stdout)
        log = self.folder / "bus.log"

        def recorded():
            words = [system.executable(), "can", "log", "--bus", self.bus("a"), "-o", str(log), "--for", "2"]
            return favour(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)).wait(60) == 0

        system.until(recorded, 30, "a recording without loss")
        identifiers = [int(word, 16) for word in re.findall(r" ([0-9A-F]{3})#", log.read_text())]
        cyclic = [i for i in identifiers if i == 0x080 or 0x180 <= i < 0x580]
        marks = [i for i, identifier in enumerate(cyclic) if identifier == 0x080]
        self.assertGreater(len(marks), 50)
        cycles = collections.Counter(after - before for before, after in zip(marks, marks[1:]))
        wanted, mean = budget[0]["frames_per_cycle"], (marks[-1] - marks[0]) / (len(marks) - 1)
        print(f"{mean:.3f} frames a cycle in {len(marks) - 1} cycles; the calculator says {wanted}", flush=True)
        self.assertEqual(cycles.most_common(1)[0][0], wanted, cycles)
        # Two SYNCs that reach delayed simulated drives are answered together; frames may move from the last cycle to the first.
        self.assertLessEqual(mean, wanted * (1 + 1 / (len(marks) - 1)))
        self.assertGreaterEqual(mean, 0.9 * wanted)


if __name__ == "__main__":
    system.main()
