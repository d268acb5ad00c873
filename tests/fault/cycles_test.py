# SPDX-License-Identifier: Apache-2.0
"""The judge of cycle logs judges made-up logs: an arm that keeps to docs/safety.md has no violation, however late its cycles are, and
each arm that breaks a rule has that violation."""
import copy
import math
import os
import pathlib
import random
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import cycles  # noqa: E402
from cycles import COMMAND_TIMEOUT, DISABLED, ENABLED, FAULT, STALE_COMMAND, STOP_REQUESTED  # noqa: E402

PERIOD = 1e-3  # s, of drives and control
SPEED = 5e-3  # m/s, the fastest that the judge permits
SLOWER = cycles.DriveJudge.STOP_DECELERATION[0] * PERIOD  # m/s, lost in each period of a stop
ENABLES, MOVES, STOPS, DISABLES, END = 10, 20, 120, 200, 240  # cycles
SEED = int(os.environ.get("TANDEM_SEED", "20261128"))


def times(lateness, rng):
    """Schedule and begin of each cycle, s: a cycle that is late makes the loop leave periods out."""
    period, last, rows = 0, 0.0, []
    for _ in range(END):
        now = max(period * PERIOD, last) + rng.uniform(1e-5, max(lateness, 2e-5)) * PERIOD
        rows.append((period * PERIOD, now))
        period, last = math.floor(now / PERIOD) + 1, now
    return rows


class Arm:
    """Log of a drive side with one arm, whose translation moves at SPEED until the commands answer states that are too old."""

    def __init__(self, lateness=0.0, rng=None):
        self.rows = []
        position, speed, before = 0.0, 0.0, 0.0
        for i, (scheduled, now) in enumerate(times(lateness, rng or random.Random(SEED))):
            state = DISABLED if i < ENABLES or i >= DISABLES else FAULT if i >= STOPS else ENABLED
            for _ in range(math.floor(now / PERIOD) - math.floor(before / PERIOD)):
                speed = SPEED if MOVES <= i < STOPS else max(0.0, speed - SLOWER) if i >= STOPS else 0.0
                position += speed * PERIOD
            before = now
            self.rows.append({
                "cycle": i, "now_ns": round(1e9 * now), "scheduled_ns": round(1e9 * scheduled), "lost": 0, "session": 7, "state": i + 1,
                "control_session": 5, "command": i + 1, "answers_session": 7, "answers_state": i if i < STOPS else i - 50, "stop": 0,
                "a.state": state, "a.faults": STALE_COMMAND if state == FAULT else 0, "a.tube1.beta.position": position,
                "a.tube1.beta.setpoint": position})
        self.now = [1e-9 * row["now_ns"] for row in self.rows]

    def write(self, folder):
        lines = [",".join(self.rows[0])]
        lines += [",".join("" if cell is None else repr(cell) for cell in row.values()) for row in self.rows]
        path = pathlib.Path(folder) / "sim-1.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    def windows(self):
        asked = cycles.Windows()
        asked.add("enable", self.now[ENABLES - 1], self.now[ENABLES])
        asked.add("motion", self.now[MOVES - 1], self.now[DISABLES])
        asked.add("disable", self.now[DISABLES - 1], self.now[DISABLES])
        return asked

    def judge(self, windows=None):
        with tempfile.TemporaryDirectory() as folder:
            return cycles.DriveJudge(cycles.Log(self.write(folder)), cycles.Budgets(PERIOD, PERIOD), windows or self.windows())


def changed(first, last, **columns):
    """A change of an arm's log: these columns from cycle `first` until before `last`; values may be functions of the row."""
    def change(arm):
        for row in arm.rows[first:last]:
            for name, value in columns.items():
                row[name.replace("__", ".")] = value(row) if callable(value) else value
    return change


def shifted(first, way):
    """The joints of all cycles from `first` on are farther by `way` times the cycles since then (m), or by a constant."""
    def change(arm):
        for k, row in enumerate(arm.rows[first:], 1):
            row["a.tube1.beta.position"] += way(k)
    return change


# What is wrong, the change of the log of a correct arm, and the violation.
WRONG = {
    "goes on with commands for old states": (changed(STOPS, DISABLES, a__state=ENABLED, a__faults=0), "did not stop"),
    "stops without saying why": (changed(STOPS, DISABLES, a__faults=0), "stopped without a cause"),
    "is in FAULT without a cause": (changed(STOPS + 9, DISABLES, a__faults=0), "without a cause"),
    "does not name the cause": (changed(STOPS - 5, DISABLES, a__faults=1), "not among the causes"),
    "leaves FAULT to ENABLED": (changed(STOPS + 20, DISABLES, a__state=ENABLED), "left FAULT"),
    "is enabled though nobody asked": (changed(ENABLES - 4, ENABLES, a__state=ENABLED), "nobody asked for `enable`"),
    "is disabled though nobody asked": (changed(DISABLES - 9, DISABLES, a__state=DISABLED), "nobody asked for `disable`"),
    "loses a fault": (changed(STOPS, STOPS + 9, a__faults=STALE_COMMAND | 1), "lost the fault bits 1"),
    "jumps": (shifted(50, lambda k: 1e-3), "jumps by"),
    "moves though nobody asked": (shifted(DISABLES + 5, lambda k: 1e-6 * k), "nobody asked for a motion"),
    "moves after it should stand": (shifted(STOPS + 65, lambda k: 1.2e-5 * min(k, 9)), "after it should stand"),
    "stops on too long a way": (shifted(STOPS + 1, lambda k: 0.4 * SPEED * PERIOD * min(k, 30)), "since it stopped, permitted"),
    "takes a command twice": (changed(60, 70, command=60), "is repeated"),
    "moves on without commands": (changed(60, STOPS, command=None), "the last command"),
    "reports a silence that was none": (
        changed(STOPS - 5, DISABLES, a__state=FAULT, a__faults=COMMAND_TIMEOUT | STALE_COMMAND), "reports a silence"),
    "does not heed `stop`": (changed(60, 61, stop=1), "did not stop"),
    "keeps its power for another control": (changed(60, STOPS, control_session=6), "a command of another control"),
    "leaves cycles out of its log": (changed(END - 1, END, lost=3), "3 cycles are missing"),
}


class TheJudge(unittest.TestCase):
    def test_finds_nothing_in_a_correct_arm_however_late_its_cycles_are(self):
        for seed in range(SEED, SEED + 60):
            rng = random.Random(seed)
            lateness = rng.uniform(0.0, 1.4)
            judge = Arm(lateness, rng).judge()
            self.assertEqual(judge.violations, [], f"seed {seed}, late by up to {lateness:.2f} periods")
            self.assertEqual([faults for _, _, faults in judge.latches], [STALE_COMMAND])
            self.assertEqual(len(judge.stops), 1)
            ramp, way = judge.stops[0]
            self.assertAlmostEqual(ramp, 50 * PERIOD, delta=5 * PERIOD)
            self.assertAlmostEqual(way, 0.5 * SPEED * 50 * PERIOD, delta=3 * SPEED * PERIOD)

    def test_finds_each_rule_that_an_arm_breaks(self):
        correct = Arm()
        for what, (change, violation) in WRONG.items():
            with self.subTest(what):
                arm = copy.deepcopy(correct)
                change(arm)
                found = [text for _, text in arm.judge().violations]
                self.assertTrue(any(violation in text for text in found), f"an arm that {what}: {found[:3]}")

    def test_wants_the_stop_that_was_asked_for(self):
        arm = Arm()
        changed(60, 61, stop=1)(arm)
        changed(60, DISABLES, a__state=FAULT, a__faults=STOP_REQUESTED)(arm)
        position = arm.rows[59]["a.tube1.beta.position"]
        for k, row in enumerate(arm.rows[60:], 1):  # a ramp of fifty periods
            position += PERIOD * max(0.0, SPEED - SLOWER * k)
            row["a.tube1.beta.position"] = position
        changed(STOPS, END, answers_state=lambda row: row["state"] - 1)(arm)
        self.assertEqual(arm.judge().violations, [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
