# SPDX-License-Identifier: Apache-2.0
"""Stops on the wall clock, with real processes at 1 kHz and the default budgets: from `stop`, or from the moment at which control or
planning is frozen, to the latch at the drives, and on to the last motion. A thread with the same priority as theirs, which does nothing but
wake up every millisecond, measures what the host adds.

    stops.py FOLDER_OF_EXECUTABLES --output FILE"""
import argparse
import json
import os
import pathlib
import signal
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "fault"), str(ROOT / "tests" / "integration" / "harness")]
import cycles  # noqa: E402
import system  # noqa: E402
from operated import Operator  # noqa: E402

TIMES = 20           # of each cause
PERIOD = 0.001       # s
FROZEN = {"control": 0.1, "planning": 0.5}  # s, longer than the budgets


class Host(threading.Thread):
    """Lateness of the wake-ups of a thread at this priority, s."""

    def __init__(self):
        super().__init__(daemon=True)
        self.late, self._ended = [], threading.Event()

    def run(self):
        if system.may_have_priorities():
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(system.priority()))
        due = time.monotonic()
        while not self._ended.is_set():
            due += PERIOD
            time.sleep(max(0.0, due - time.monotonic()))
            self.late.append(max(0.0, time.monotonic() - due))

    def end(self):
        self._ended.set()
        self.join()


class Stops(system.SystemTest):
    results = {}

    def test_stops(self):
        logs = self.folder / "cycles"
        running = self.start("laptop", without=["recorder"], control_period_s=PERIOD, sim_period_ms=1e3 * PERIOD,
                             realtime_priority=system.priority(), cycle_log=logs)
        operator, host, causes = Operator(self, running), Host(), []
        host.start()
        for _ in range(TIMES):
            for cause in ("stop", *FROZEN):
                if operator.begin_motion(self.long_line()):
                    causes.append((cause, self.stop(running, cause)))
                    system.until(lambda: set(running.states()) == {"FAULT"}, 30, "the arms stop")
                operator.end_motion()
        host.end()
        running.close()
        judges = cycles.judged(logs, cycles.Budgets(PERIOD, PERIOD), operator.windows)
        self.assertEqual([text for judge in judges for _, text in judge.violations], [])
        drives, = (judge for judge in judges if isinstance(judge, cycles.DriveJudge))
        self.results.update(table(causes, drives), host=percentiles(host.late))

    @staticmethod
    def stop(running, cause):
        begin = time.monotonic()
        if cause == "stop":
            running.robot("stop")
        else:
            os.kill(running.pids[cause], signal.SIGSTOP)
            time.sleep(FROZEN[cause])
            os.kill(running.pids[cause], signal.SIGCONT)
        return begin


def percentiles(values):
    """In us, as the other benchmarks."""
    ordered = sorted(1e6 * value for value in values)
    return {name: ordered[min(len(ordered) - 1, int(part * len(ordered)))]
            for name, part in (("p50", 0.5), ("p90", 0.9), ("p99", 0.99), ("p999", 0.999), ("max", 1.0))} | {"count": len(ordered)}


def table(causes, drives):
    """Per cause: time to the latch, and from there to the last motion."""
    latches, ways = {}, {}
    moved = motions(drives.log)
    for cause, begin in causes:
        latch = min((at for at, _, _ in drives.latches if at >= begin), default=None)
        if latch is None or latch > begin + 5.0:
            continue
        latches.setdefault(cause, []).append(latch - begin)
        ways.setdefault(cause, []).append(max([at for at in moved if latch <= at < latch + 1.0], default=latch) - latch)
    return {cause: {"latch": percentiles(latches[cause]), "motion": percentiles(ways[cause])} for cause in latches}


def motions(log):
    """Times of the cycles in which an arm moved."""
    times = set()
    for arm in log.arms:
        positions = log.joints(arm, "position")
        times |= {now for now, before, after in zip(log.now[1:], positions, positions[1:])
                  if max(abs(b - a) for a, b in zip(before, after)) > cycles.STILL}
    return sorted(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    sys.argv[1:] = [arguments.folder, "Stops"]
    try:
        system.main()
    except SystemExit as ended:
        if ended.code:
            raise
    arguments.output.write_text(json.dumps(Stops.results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
