# SPDX-License-Identifier: Apache-2.0
"""The paper's experiment in lock-step: control periods per second in one process and over DDS, and the results of each method; Monte
Carlo tasks per second, on one core and on all.

    simulation.py TANDEM --output FILE    times include start and end of the processes"""
import argparse
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import tempfile
import time

PERIOD = 0.1  # s, of control in the experiment
TIMES = 2
TASKS = 100


PRESETS = pathlib.Path(__file__).resolve().parents[1] / "config" / "presets"


def run(program, experiment, *options):
    """Rows of the summary, and the time in seconds."""
    with tempfile.TemporaryDirectory(prefix="tandem-simulation-") as folder:
        begin = time.perf_counter()
        # Exit code 1 (points not reached, or limits violated) is a result of the method, not an error.
        subprocess.run([program, "experiment", experiment, "--csv", folder, *options], check=False, capture_output=True)
        seconds = time.perf_counter() - begin
        with open(pathlib.Path(folder, "summary.csv"), encoding="utf-8") as file:
            return list(csv.DictReader(file)), seconds


def speed(program, where, *options):
    rows, seconds = min((run(program, "table3", *options) for _ in range(TIMES)), key=lambda answer: answer[1])
    steps = sum(int(row["iterations"]) for row in rows)
    return {"where": where, "steps": steps, "seconds": seconds, "steps_per_s": steps / seconds, "times_real_time": PERIOD * steps / seconds}


def all_methods(program):
    schema = json.loads(subprocess.run([program, "schema", "experiment"], check=True, capture_output=True, text=True).stdout)
    return schema["properties"]["methods"]["items"]["enum"]


def montecarlo(program, method, jobs, tasks=TASKS, times=TIMES):
    """The same random tasks for every method; the time includes their generation."""
    best = math.inf
    for _ in range(times):
        begin = time.perf_counter()
        done = subprocess.run([program, "montecarlo", "--tasks", str(tasks), "--infeasible", "0.1", "--methods", method,
                               "--jobs", str(jobs), "--json"],
                              check=False, capture_output=True, text=True)
        best = min(best, time.perf_counter() - begin)
        row, = json.loads(done.stdout)
    return {"method": method, "jobs": jobs, "tasks": tasks, "seconds": best, "tasks_per_s": tasks / best,
            "succeeded": row["succeeded"], "feasible": row["feasible"]}


def quality(program):
    """Table 3's runs with all methods."""
    methods = all_methods(program)
    text = (PRESETS / "experiments/table3.yaml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^methods:.*$", f"methods: [{', '.join(methods)}]", text)
    text = re.sub(r"(?m)^robot:.*$", f"robot: {PRESETS / 'robots/ark2024.yaml'}", text)
    with tempfile.TemporaryDirectory(prefix="tandem-simulation-") as folder:
        file = pathlib.Path(folder, "all-methods.yaml")
        file.write_text(text, encoding="utf-8")
        rows, _ = run(program, file, "--offline")
    answer = []
    for method in methods:
        mine = [row for row in rows if row["method"] == method]
        if not mine:
            continue
        total = {key: sum(int(row[key]) for row in mine)
                 for key in ("points", "converged", "iterations", "limit_violations", "gate_actions")}
        rms = {key: math.sqrt(sum(float(row[key]) ** 2 for row in mine) / len(mine)) for key in ("rms_ab", "rms_a")}
        answer.append({"method": method, "runs": len(mine), **total, **rms})
    return answer


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    results = {"speed": [speed(arguments.program, "one process", "--offline"), speed(arguments.program, "four processes over DDS")],
               "methods": quality(arguments.program),
               "montecarlo": [montecarlo(arguments.program, method, jobs)
                              for method in all_methods(arguments.program) for jobs in sorted({1, os.cpu_count()})]}
    arguments.output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
