# SPDX-License-Identifier: Apache-2.0
"""Table of all results of deploy/bench.sh.

    report.py FOLDER [--markdown] [--figures FOLDER]

FOLDER contains the results; the script writes all of them, with the machine, to bench.json in it. Times are in us."""
import argparse
import json
import os
import pathlib
import platform
import re

TIMES = ("p50", "p90", "p99", "p999", "max")


def machine():
    text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    return {"processor": model.group(1) if model else platform.machine(), "cores": os.cpu_count(),
            "kernel": ".".join(platform.release().split(".")[:2])}


class Results:
    """Result files of a folder; absent files are empty."""

    def __init__(self, folder):
        self.files = {}
        for file in sorted(folder.glob("*.json")):
            if file.name != "bench.json":
                self.files[file.stem] = json.loads(file.read_text(encoding="utf-8"))

    def runs(self, name, *kinds):
        """(parts of the name, run) of a Google Benchmark; with `kinds`, only those."""
        found = [(run["name"].split("/iterations")[0].split("/"), run) for run in self.files.get(name, {}).get("benchmarks", [])]
        return [(parts, run) for parts, run in found if not kinds or parts[0] in kinds]

    def load(self):
        loads = [file["context"]["load_avg"][0] for file in self.files.values()
                 if isinstance(file, dict) and file.get("context", {}).get("load_avg")]
        return (min(loads), max(loads)) if loads else None


def timed(run, digits=2):
    return [f"{run[name]:.{digits}f}" for name in TIMES] + [f"{run.get('failed', 0):.0f}"]


def ratio(a, b):
    if not a or not b or not b["p50"]:
        return "-"
    value = a["p50"] / b["p50"]
    return f"{value:.0f}" if value >= 10 else f"{value:.2f}"


def kinematics(results):
    runs = results.runs("bench_kinematics", "rigid", "compliant", "loaded", "shooting")
    peers = {tuple(parts[1:]): run for parts, run in runs if parts[0] == "shooting"}
    rows = [[*parts, *timed(run), ratio(None if parts[0] == "loaded" else peers.get(tuple(parts[1:])), run)] for parts, run in runs]
    return "Tip, Jacobian and stability of one arm, in one call", \
        ["model", "arm", "curved parts", "joints", *TIMES, "failed", "shooting / this"], rows


def cooperative(results):
    rows = [[*parts, *[""] * (4 - len(parts)), *timed(run)] for parts, run in results.runs("bench_kinematics", "rod", "chain", "grasp")]
    return "Catheters: rods, the closed chain of two arms, a grasp", ["what", "arms", "contact or load", "start", *TIMES, "failed"], rows


def steps(results):
    runs = results.runs("bench_control")
    peers = {tuple(parts[:2]): run for parts, run in runs if parts[2] == "ipopt"}
    rows = [[*parts, *timed(run), ratio(peers.get(tuple(parts[:2])), run)] for parts, run in runs]
    return "One quadratic programme; one control step of two arms without the models", \
        ["what", "problem", "solver", "start", *TIMES, "failed", "Ipopt / this"], rows


def cycles(results):
    runs = results.runs("bench_cycle", "cycle")
    peers = {tuple(parts[1:3]): run for parts, run in runs if parts[3] == "ipopt"}
    rows = [[*parts[1:], *timed(run), ratio(peers.get(tuple(parts[1:3])), run)] for parts, run in runs]
    return "Control's whole cycle of two arms: both models with Jacobians, limits, method", \
        ["method", "model", "solver", "start", *TIMES, "failed", "Ipopt / this"], rows


def poses(results):
    runs = results.runs("bench_cycle", "pose")
    peers = {parts[1]: run for parts, run in runs if parts[2] == "ipopt"}
    rows = [[*parts[1:], *timed(run, 1), ratio(peers.get(parts[1]), run)] for parts, run in runs]
    return "Inverse kinematics of two arms, from point to point of a path", ["model", "solver", *TIMES, "failed", "Ipopt / this"], rows


def scaling(results):
    runs = results.runs("bench_cycle", "arms", "tubes")
    first = {}
    rows = []
    for parts, run in runs:
        base = first.setdefault(tuple(parts[:3]), run)
        rows.append([f"{parts[4]} {parts[0] if parts[4] != '1' else parts[0][:-1]}", parts[1], parts[2], *timed(run), ratio(run, base)])
    return "Growing robots: a whole cycle with snsqp by arms, one arm's tip by tubes", \
        ["robot", "what", "model", *TIMES, "failed", "this / smallest"], rows


def hal(results):
    rows = [[*parts[1:], *timed(run), f"{run['wire']:.0f}", f"{100 * run['wire_share']:.1f} %"] for parts, run in results.runs("bench_hal")]
    return "One cycle of the HAL, two arms on two buses, beside its frames on a wire of 1 Mbit/s", \
        ["robot", "state", *TIMES, "failed", "wire", "wire's share"], rows


def trips(results):
    runs = results.runs("bench_round_trip")
    bare = dict((parts[1], run) for parts, run in runs).get("ping_pong")
    rows = [[{"ping_pong": "bare Fast DDS ping-pong", "control": "state, control, command"}[parts[1]], *timed(run, 1), ratio(run, bare)]
            for parts, run in runs]
    secure = results.runs("bench_security")
    plain = dict((parts[1], run) for parts, run in secure).get("plain")
    rows += [[f"two participants, {parts[1]}", *timed(run, 1), ratio(run, plain)] for parts, run in secure]
    return "Round trips over DDS, on loopback", ["what", *TIMES, "failed", "this / bare, this / plain"], rows


def batches(results):
    rows = [[r["model"], str(r["rows"]), str(r["threads"]), f"{r['cpp_us']:.3f}", f"{r['python_us']:.3f}", f"{r['ratio']:.2f}"]
            for r in results.files.get("batch", [])]
    return "Tip poses in batches: time of a row", ["model", "rows", "threads", "C++", "Python", "Python / C++"], rows


def simulation(results):
    rows = [[r["where"], str(r["steps"]), f"{r['seconds']:.2f}", f"{r['steps_per_s']:.0f}", f"{r['times_real_time']:.0f}"]
            for r in results.files.get("simulation", {}).get("speed", [])]
    return "Lock-step simulation: Table 3 of the paper, all runs", ["in", "control periods", "s", "periods per s", "times real time"], rows


def methods(results):
    rows = [[r["method"], f"{r['converged']} of {r['points']}", f"{r['iterations'] / r['runs']:.0f}", f"{r['rms_ab']:.3f}",
             f"{r['rms_a']:.3f}", str(r["limit_violations"]), str(r["gate_actions"])]
            for r in results.files.get("simulation", {}).get("methods", [])]
    return "What each method achieves: Table 3's six runs, rigid model", \
        ["method", "points reached", "iterations a run", "RMS of x_AB, mm", "RMS of x_A, mm", "iterations beyond limits",
         "gate acted"], rows


def montecarlo(results):
    runs = results.files.get("simulation", {}).get("montecarlo", [])
    alone = {r["method"]: r["tasks_per_s"] for r in runs if r["jobs"] == 1}
    rows = [[r["method"], str(r["jobs"]), str(r["tasks"]), f"{r['seconds']:.2f}", f"{r['tasks_per_s']:.1f}",
             f"{r['tasks_per_s'] / alone[r['method']]:.2f}", f"{r['succeeded']} of {r['feasible']}"] for r in runs]
    return "Monte Carlo: random tasks a second", \
        ["method", "cores", "tasks", "s", "tasks per s", "of one core's", "feasible ones done"], rows


def stops(results):
    found = results.files.get("stops", {})
    rows = [[f"from {cause} to the latch", *timed(run["latch"])[:-1]] for cause, run in found.items() if cause != "host"]
    rows += [[f"{cause}: from the latch to the last motion", *timed(run["motion"])[:-1]] for cause, run in found.items() if cause != "host"]
    rows += [["lateness of a thread that only wakes up", *timed(found["host"])[:-1]]] if found else []
    return "Stops at 1 kHz on the wall clock: client, DDS, both loops and the ramp included", ["what", *TIMES], rows


def instructions(results):
    return "Instructions per call, by callgrind", ["what", "instructions"], \
        [[name, str(count)] for name, count in results.files.get("instructions", {}).items()]


SECTIONS = (kinematics, cooperative, steps, cycles, poses, scaling, hal, trips, batches, simulation, methods, montecarlo, stops,
            instructions)


def show(title, heads, rows, markdown):
    numeric = [all(re.fullmatch(r"[-\d.]+( %)?|-", row[i]) for row in rows) and i > 0 for i in range(len(heads))]
    if markdown:
        print(f"### {title}\n\n| " + " | ".join(heads) + " |")
        print("|" + "|".join("---:" if right else "---" for right in numeric) + "|")
        for row in rows:
            print("| " + " | ".join(row) + " |")
    else:
        widths = [max(len(row[i]) for row in [heads, *rows]) for i in range(len(heads))]
        print(f"== {title}")
        for row in [heads, *rows]:
            print("  ".join(f"{cell:>{width}}" if right else f"{cell:<{width}}"
                            for cell, width, right in zip(row, widths, numeric)).rstrip())
    print()


def figures(results, folder):
    import matplotlib  # pylint: disable=import-outside-toplevel
    matplotlib.use("Agg")
    from matplotlib import pyplot  # pylint: disable=import-outside-toplevel
    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = pyplot.subplots(1, 3, figsize=(13, 3.8), constrained_layout=True)
    for axis, kind, label in ((axes[0], "tubes", "tip of one arm"), (axes[1], "arms", "whole cycle, snsqp")):
        for model in "rigid", "compliant":
            runs = [(int(parts[4]), run) for parts, run in results.runs("bench_cycle", kind) if parts[2] == model]
            for time, style in (("p50", "-o"), ("p99", "--")):
                axis.plot([x for x, _ in runs], [run[time] for _, run in runs], style, label=f"{model}, {time}",
                          color={"rigid": "C0", "compliant": "C1"}[model])
        axis.set(xlabel=kind, ylabel="us", yscale="log", title=label)
        axis.xaxis.get_major_locator().set_params(integer=True)
        axis.legend(fontsize=8)
    batch = results.files.get("batch", [])
    for model, threads in sorted({(r["model"], r["threads"]) for r in batch}, reverse=True):
        mine = [r for r in batch if (r["model"], r["threads"]) == (model, threads)]
        line, = axes[2].plot([r["rows"] for r in mine], [r["python_us"] for r in mine], "-o",
                             label=f"{model}, {threads} thread{'s' if threads > 1 else ''}")
        axes[2].plot([r["rows"] for r in mine], [r["cpp_us"] for r in mine], ":", color=line.get_color())
    axes[2].set(xlabel="rows of a batch", ylabel="us a row", xscale="log", yscale="log", title="tip poses in batches: Python, C++ dotted")
    axes[2].legend(fontsize=7, loc="center right")
    figure.savefig(folder / "performance-scaling.png", dpi=110)

    runs = [(parts, run) for parts, run in results.runs("bench_cycle", "cycle") if parts[4] == "warm"]
    figure, axis = pyplot.subplots(figsize=(8, 0.3 * len(runs) + 1.2), constrained_layout=True)
    for row, (parts, run) in enumerate(reversed(runs)):
        axis.plot([run[time] for time in TIMES], [row] * len(TIMES), "-|", color="C0" if parts[2] == "rigid" else "C1", markersize=9)
        axis.plot(run["p50"], row, "ko", markersize=4)
    axis.set_yticks(range(len(runs)), [f"{parts[1]}, {parts[2]}, {parts[3]}" for parts, _ in reversed(runs)])
    axis.set(xscale="log", xlabel="us a cycle of two arms: median (dot), 90 %, 99 %, 99.9 %, largest")
    axis.grid(axis="x", alpha=0.3)
    figure.savefig(folder / "performance-cycle.png", dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--figures", type=pathlib.Path)
    arguments = parser.parse_args()
    results = Results(arguments.folder)
    here, load = machine(), results.load()
    (arguments.folder / "bench.json").write_text(json.dumps({"machine": here, "results": results.files}, indent=1) + "\n", encoding="utf-8")
    busy = f"; load {load[0]:.1f} to {load[1]:.1f} as benchmarks began" if load else ""
    print(f"{here['processor']}, {here['cores']} cores, Linux {here['kernel']}{busy}. Times in us.\n")
    for section in SECTIONS:
        title, heads, rows = section(results)
        if rows:
            show(title, heads, rows, arguments.markdown)
    if arguments.figures:
        figures(results, arguments.figures)


if __name__ == "__main__":
    main()
