# SPDX-License-Identifier: Apache-2.0
"""The system at 1 kHz for a while, moving, with recorder, console and a second client, beside a system in lock-step: what its loops
missed and how late they were, that neither memory nor open files grow, that every gap of a recording is counted, that the digits in
lock-step stay the same, and that the periodic threads neither allocate nor lock.

TANDEM_SOAK says how long, s (default 60; before a release an hour: 3600). The machine is anybody's: late cycles are reported, and a
fault that they cause is cleared and counted, not judged."""
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PROBE = pathlib.Path(sys.argv.pop(2))  # the library to preload
SECONDS = float(os.environ.get("TANDEM_SOAK", "60"))
WARM_UP = min(300.0, SECONDS / 4)  # s, after which memory counts: each process remembers who the last 32 clients were
# Limits of the lower ends of the slopes' intervals, per second. In the first minutes the allocators still take memory for good.
GROWTH = {"KiB": 10.0 if SECONDS < 600 else 0.3, "files": 0.01 if SECONDS < 600 else 0.001}


def resources(pid):
    """Memory in KiB and open files of a process."""
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    memory = next(int(line.split()[1]) for line in text.splitlines() if line.startswith("VmRSS:"))
    return {"KiB": memory, "files": len(os.listdir(f"/proc/{pid}/fd"))}


def slope(points):
    """Least-squares slope of (time, value), and the half width of its 95 % interval."""
    count = len(points)
    mean_x, mean_y = (sum(values) / count for values in zip(*points))
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    steep = sum((x - mean_x) * (y - mean_y) for x, y in points) / spread
    rest = sum((y - mean_y - steep * (x - mean_x)) ** 2 for x, y in points)
    return steep, 1.96 * math.sqrt(rest / max(1, count - 2) / spread)


class LockStep(threading.Thread):
    """Runs a short experiment over DDS again and again: `answers` are its different results."""

    def __init__(self, folder):
        super().__init__(daemon=True)
        self.runs, self.answers, self._ended = 0, set(), threading.Event()
        self._path = system.deployment(folder, "lockstep", without=["recorder"], prefix=f"lock{os.getpid()}")
        self._experiment = system.short_experiment(folder, "nspqp")

    def run(self):
        while not self._ended.is_set():
            done = subprocess.run(["nice", "-n", "10", system.executable(), "experiment", str(self._experiment), "--deployment",
                                   str(self._path), "--json"], capture_output=True, text=True, check=False,
                                  env={**os.environ, "LD_PRELOAD": ""})
            rows = [{key: value for key, value in row.items() if "time" not in key and not key.endswith("_s")}
                    for row in json.loads(done.stdout)["rows"]]
            self.answers.add(json.dumps(rows))
            self.runs += 1

    def end(self):
        self._ended.set()
        self.join(120)


class Soak(system.SystemTest):
    def start_probed(self):
        os.environ["TANDEM_PROBE"] = str(self.folder / "probe")
        os.environ["LD_PRELOAD"] = str(PROBE)
        self.addCleanup(os.environ.pop, "LD_PRELOAD", None)
        real_time = system.may_have_priorities()
        running = self.start("laptop-1khz", console=f"{{port: {system.free_port()}}}", **system.real_time())
        del os.environ["LD_PRELOAD"]  # clients need none
        print(f"  {'real-time priorities, default budgets' if real_time else 'default scheduling, wide budgets'}")
        return running

    def record(self, running):
        self.recording = self.folder / "soak.mcap"
        process = subprocess.Popen([system.executable(), "record", str(running.path), "--output", str(self.recording),
                                    "--topics", "hal/status", "control/status"], stdout=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def move(self, running):
        """To and fro. @return runs, faults, and (time, process, resources) of each moment"""
        ways = [self.trajectory(name, [0, way, 0], following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=10)
                for name, way in (("there", 8), ("back", -8))]
        began, runs, faults, seen = time.monotonic(), 0, 0, []
        while time.monotonic() - began < SECONDS:
            answer = running.robot("run", ways[runs % 2])
            if answer.returncode == 0:
                runs += 1
            else:
                faults += 1
                print(f"  {answer.stderr.strip()}", flush=True)
                self.assert_ok(running.robot("disable"))
                self.assert_ok(running.robot("enable"))
            if time.monotonic() - began > WARM_UP:
                seen += [(time.monotonic(), name, resources(pid)) for name, pid in running.pids.items()]
        return runs, faults, seen

    def assert_flat(self, running, seen):
        for name in running.pids:
            for what, allowed in GROWTH.items():
                steep, half = slope([(at, found[what]) for at, process, found in seen if process == name])
                print(f"  {name}: {steep:+.4f} +- {half:.4f} {what}/s", flush=True)
                self.assertLess(steep - half, allowed, f"{name}: {what} grow")

    def test_at_1_khz(self):
        running = self.start_probed()
        recorder, beside = self.record(running), LockStep(self.folder)
        beside.start()
        began = time.monotonic()
        runs, faults, seen = self.move(running)
        control = running.status()["control"]
        print(f"  {time.monotonic() - began:.0f} s, {runs} runs, {faults} ended by faults, {control['cycles']} cycles of control: "
              f"{control['overruns']} overruns, latest wake-up {1e3 * control['jitter_max_s']:.2f} ms late, "
              f"longest cycle {1e3 * control['cycle_time_max_s']:.2f} ms")
        beside.end()
        print(f"  beside it: {beside.runs} experiments in lock-step with {len(beside.answers)} different results", flush=True)
        self.assertGreater(beside.runs, 0)
        self.assertEqual(len(beside.answers), 1)
        self.assertGreater(runs, 2 * faults)
        self.assert_flat(running, seen)
        self.assert_gaps_counted(recorder)
        running.end_watch()
        running.up.send_signal(signal.SIGINT)
        running.up.wait(20)
        for name in ("sim", "control"):
            cycles, allocations, frees, locks = map(int, (self.folder / f"probe.{running.pids[name]}").read_text().split())
            print(f"  {name}: {cycles} cycles, {allocations} allocations, {frees} frees, {locks} locks on the periodic thread", flush=True)
            self.assertGreater(cycles, 0.2 * 1000 * SECONDS, name)
            self.assertEqual((allocations, frees, locks), (0, 0, 0), name)

    def assert_gaps_counted(self, recorder):
        """The recording is complete but for samples that its writers' numbers show as lost: `record` says so by its exit code."""
        recorder.send_signal(signal.SIGINT)
        code = recorder.wait(30)
        described = json.loads(self.assert_ok(system.run("info", self.recording, "--json")).stdout)
        lost = sum(topic["lost"] for topic in described["topics"].values())
        print(f"  recording: exit code {code}, {lost} samples lost", flush=True)
        self.assertEqual(code, 1 if lost else 0)


if __name__ == "__main__":
    system.main()
