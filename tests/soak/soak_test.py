# SPDX-License-Identifier: Apache-2.0
"""The system at 1 kHz for a while, moving: what its loops missed, how late they were, whether its memory grows, and that the
periodic threads neither allocate nor lock.

TANDEM_SOAK says how long, s (default 60). The machine is anybody's, so late cycles are reported, not judged."""
import itertools
import os
import pathlib
import signal
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PROBE = pathlib.Path(sys.argv.pop(2))  # the library to preload
SECONDS = float(os.environ.get("TANDEM_SOAK", "60"))
WARM_UP = 10.0        # s, after which memory counts
GROWTH = 10.0         # KiB/s, the median over the runs: ten bytes of each period; that once more memory is needed is no leak


def resident(pid):
    """KiB."""
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    raise AssertionError(f"process {pid} has no memory")


class Soak(system.SystemTest):
    def test_at_1_khz(self):
        os.environ["TANDEM_PROBE"] = str(self.folder / "probe")
        os.environ["LD_PRELOAD"] = str(PROBE)
        self.addCleanup(os.environ.pop, "LD_PRELOAD", None)
        running = self.start("laptop-1khz", budgets=system.WIDE_BUDGETS)
        del os.environ["LD_PRELOAD"]  # clients need none
        line = self.trajectory("to-and-fro", [0, 8, 0], following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=10)
        back = self.trajectory("back", [0, -8, 0], following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=10)
        began, runs, seen = time.monotonic(), 0, []
        while time.monotonic() - began < SECONDS:
            self.assert_ok(running.robot("run", (line, back)[runs % 2]))
            runs += 1
            if time.monotonic() - began > WARM_UP:
                seen.append((time.monotonic(), {name: resident(pid) for name, pid in running.pids.items()}))
        growth = {name: statistics.median((after[name] - before[name]) / (late - early)
                                          for (early, before), (late, after) in itertools.pairwise(seen))
                  for name in running.pids}
        status = running.status()
        control = status["control"]
        print(f"  {time.monotonic() - began:.0f} s, {runs} runs, {control['cycles']} cycles of control: {control['overruns']} overruns, "
              f"latest wake-up {1e3 * control['jitter_max_s']:.2f} ms late, longest cycle {1e3 * control['cycle_time_max_s']:.2f} ms")
        print("  memory grew by (KiB/s):", {name: round(grown, 2) for name, grown in growth.items()}, flush=True)
        self.assertEqual([arm["faults"] for arm in status["arms"]], ["none", "none"])
        for name, grown in growth.items():
            self.assertLess(grown, GROWTH, name)
        running.end_watch()
        running.up.send_signal(signal.SIGINT)
        running.up.wait(10)
        for name in ("sim", "control"):
            cycles, allocations, frees, locks = map(int, (self.folder / f"probe.{running.pids[name]}").read_text().split())
            print(f"  {name}: {cycles} cycles, {allocations} allocations, {frees} frees, {locks} locks on the periodic thread", flush=True)
            self.assertGreater(cycles, 0.2 * 1000 * SECONDS, name)
            self.assertEqual((allocations, frees, locks), (0, 0, 0), name)


if __name__ == "__main__":
    system.main()
