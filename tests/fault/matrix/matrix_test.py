# SPDX-License-Identifier: Apache-2.0
"""The fault matrix: every fault that tandem-drive-sim can inject, killed and frozen processes.

Detection time, reaction, time to standstill and distance of each axis are measured, and compared with the budgets in budgets.py.
`matrix_test.py FOLDER_OF_EXECUTABLES --write` writes docs/fault-matrix.md from the measurements."""
import atexit
import json
import os
import pathlib
import re
import signal
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests" / "integration" / "hal"), str(ROOT / "tests" / "fault")]
from budgets import DEVICES, PROCESSES  # noqa: E402
from hardware import COUNTS_PER_M, COUNTS_PER_RAD, HalTest, system  # noqa: E402
from operated import Operator  # noqa: E402

DOCUMENT = ROOT / "docs" / "fault-matrix.md"
CONTROL_PERIOD = 0.05     # s
DRIVE_HEARTBEAT_MS = 100  # half of it: deadline of the command PDO
# Faults reported by the processes that watch each process, by their own clock; the drives watch the HAL.
NOTICED_AS = {"planning": "reference_timeout", "control": "command_timeout"}
STOP_S = 0.2              # of a drive by itself, by its own clock: from 5 mm/s by its quick stop, and its lag
ATTEMPTS = 5             # to have arms in motion: the host may be late for longer than the default budgets
STILL = 1e-3              # mm/s and deg/s: threshold of standstill
POWERED = "operation enabled"
measured = {"devices": [], "processes": []}


def worst(runs, key):
    """The longest of several runs; None if no run has a value."""
    values = [run[key] for run in runs if run[key] >= 0]
    return max(values) if values else None


class Devices(system.SystemTest):
    """Simulated time: reactions of the HAL, independent of this machine's load."""

    @classmethod
    def setUpClass(cls):
        answer = system.run(program="device_faults", timeout=100)
        if answer.returncode != 0:
            raise AssertionError(answer.stderr)
        cls.report = json.loads(answer.stdout)
        cls.rows = {(row["where"], row["fault"], row["value"]): row["runs"] for row in cls.report["rows"]}
        measured["report"] = cls.report

    def test_every_fault_has_a_budget(self):
        self.assertEqual(set(self.rows), set(DEVICES))

    def test_budgets(self):
        for key, runs in self.rows.items():
            stopped = [run for run in runs if run["state"] == "FAULT"]
            guards = sorted({guard for run in runs for guard in run["guards"].split(", ")} - {"none"})
            measured["devices"].append({
                "key": key, "noticed": worst(stopped, "noticed_ms"), "standing": worst(stopped, "standing_ms"),
                "travel": worst(stopped, "travel_mm"), "turn": worst(stopped, "travel_deg"), "guards": guards,
                "cause": next((run["cause"] for run in stopped), "-"), "stopped": len(stopped)})
            with self.subTest(fault=key):
                self.judge(DEVICES[key], runs, stopped)

    def test_drives_stop_after_the_end_of_the_hal(self):
        for row in self.report["ends"]:
            with self.subTest(row=row):
                self.assertTrue(row["as_expected"])
                self.assertIn(end_title(row), DOCUMENT.read_text())
                if row["bound_mm"] is not None:
                    self.assertGreater(row["standing_ms"], 0)
                    self.assertLessEqual(row["travel_mm"], row["bound_mm"])

    def judge(self, budget, runs, stopped):
        goes_on = not budget.everywhere
        self.assertEqual({run["other_state"] for run in runs}, {"ENABLED" if goes_on else "FAULT"}, "the other arm")
        self.assertEqual({run["other_moving"] for run in runs}, {6 if goes_on else 0}, "the other arm")
        # Joints lag behind their setpoints, by less than the following error limit.
        self.assertLessEqual(max(run["violation_mm"] for run in runs), 0.5)
        for run in runs:
            if run not in stopped:
                self.assertIsNone(budget.noticed, run)
                self.assertEqual((run["state"], run["moving"]), ("ENABLED", 6))
                continue
            self.assertIsNotNone(budget.noticed, run)
            self.assertEqual(run["moving"], 0, run)
            self.assertLessEqual(run["noticed_ms"], budget.noticed, run)
            self.assertLessEqual(run["standing_ms"], budget.standing(), run)
            self.assertLessEqual(run["travel_mm"], budget.travel(self.report["speed_mm_per_s"]), run)


class Sampler(threading.Thread):
    """Positions and speeds of all drives, in mm and degrees, sampled every few milliseconds."""

    def __init__(self, test):
        super().__init__(daemon=True)
        self.samples, self._test, self._ending = [], test, threading.Event()

    def look(self):
        drives = [drive for bus in "ab" for drive in self._test.drives(bus)]
        scale = [1e3 / COUNTS_PER_M if drive["id"] <= 3 else 57.29578 / COUNTS_PER_RAD for drive in drives]
        return {"at": time.monotonic(), "position": [d["position"] * s for d, s in zip(drives, scale)],
                "speed": [abs(d["velocity"] * s) for d, s in zip(drives, scale)],
                "states": [d["state"] for d in drives]}

    def run(self):
        while not self._ending.wait(0.002):
            self.samples.append(self.look())

    def end(self):
        self._ending.set()
        self.join()


class Processes(HalTest):
    """Real processes, sockets and time. Detection times are asserted by the clock of the detecting process; wall-clock times, which
    depend on this machine, are measured for the document only."""

    budgets = f"{{drive_heartbeat_ms: {DRIVE_HEARTBEAT_MS}}}"  # all by default
    feedback_budget_ms = 30

    def setUp(self):
        super().setUp()
        self.log = self.folder / "log"
        system.System.stderr = self.log.open("w")
        self.addCleanup(setattr, system.System, "stderr", None)
        self.addCleanup(system.System.stderr.close)
        for bus in "ab":
            self.drive_sim(bus)

    def moving(self):
        running = self.start_hal(control_period_s=CONTROL_PERIOD)
        self.await_ready(running)
        self.begin_motion(running)
        return running

    def begin_motion(self, running):
        operator = Operator(self, running)
        for _ in range(ATTEMPTS):
            if operator.begin_motion(self.long_line()):
                return
            operator.end_motion()
            self.await_ready(running)
        self.fail(f"the arms do not move: {operator.why}")

    def measure(self, running, victim, sign):
        """Kills or freezes a process of a moving system, and samples the drives until standstill."""
        sampler = Sampler(self)
        before = sampler.look()
        hurt = time.monotonic()
        os.kill(running.pids[victim], sign)
        sampler.start()

        def over():
            recent = sampler.samples[-20:]
            return len(recent) == 20 and all(max(s["speed"]) < STILL and POWERED not in s["states"] for s in recent)

        system.until(over, 10, "all axes stand, without torque")
        sampler.end()
        half = 0.5 * max(before["speed"])
        last_fast = max([s["at"] for s in sampler.samples if max(s["speed"]) > half], default=hurt)
        last_move = max([s["at"] for s in sampler.samples if max(s["speed"]) >= STILL], default=hurt)
        last_torque = max([s["at"] for s in sampler.samples if POWERED in s["states"]], default=hurt)
        ways = [abs(b - a) for a, b in zip(before["position"], sampler.samples[-1]["position"])]
        return {"stopping": 1e3 * (last_fast - hurt), "standing": 1e3 * (last_move - hurt),
                "powerless": 1e3 * (last_torque - hurt),
                "travel": max(ways[k] for k in range(12) if k % 6 < 3),
                "turn": max(ways[k] for k in range(12) if k % 6 >= 3)}

    def judge(self, victim, sign, found):
        budget = PROCESSES[victim]
        limit = budget.noticed_ms(CONTROL_PERIOD, DRIVE_HEARTBEAT_MS)
        found.update(victim=victim, signal=sign, budget=limit)
        measured["processes"].append(found)
        print(f"  {found['signal']} {victim}: stops after {found['stopping']:.0f} ms (budget {limit:.0f}), "
              f"stands after {found['standing']:.0f} ms, no torque after {found['powerless']:.0f} ms, "
              f"{found['travel']:.3f} mm, "
              f"{found['turn']:.3f} deg; {found['state']}", flush=True)
        if victim in NOTICED_AS:
            self.assert_noticed(NOTICED_AS[victim], died=sign == "SIGKILL")
        else:
            self.assert_drives_stopped_by_themselves()

    def assert_noticed(self, fault, died):
        """The watching process has latched a fault, at a tick at which the age was above its budget by its own clock. The unit tests
        (Budgets.*) show that no such tick passes without a fault: this test covers which process detects what. A death may be reported
        to `tandem up` sooner, which then stops everything."""
        if died and "stop_requested" in self.log.read_text():
            return
        found = re.findall(rf"{fault}[^:\n]*: ([\d.e-]+) s, allowed ([\d.e-]+) s", self.log.read_text())
        self.assertTrue(found, self.log.read_text())
        for silence, allowed in found:
            self.assertGreaterEqual(float(silence), float(allowed))  # both are rounded to five digits

    def assert_drives_stopped_by_themselves(self):
        for drive in (drive for bus in "ab" for drive in self.drives(bus)):
            self.assertGreaterEqual(drive["contact_losses"], 1, drive)
            self.assertLessEqual(drive["stop_duration"], STOP_S, drive)

    def torque_goes(self):
        system.until(lambda: POWERED not in Sampler(self).look()["states"], 5, "no drive has torque")
        return sorted({drive["state"] for bus in "ab" for drive in self.drives(bus)})

    def test_frozen(self):
        running = self.moving()
        for victim in ("planning", "control", "hal"):
            if victim != "planning":
                self.begin_motion(running)
            found = self.measure(running, victim, signal.SIGSTOP)
            # Longer than all budgets, shorter than the liveliness lease of other processes.
            stood = Sampler(self).look()["position"]
            os.kill(running.pids[victim], signal.SIGCONT)
            states = self.torque_goes()
            system.until(lambda: running.states() == ["FAULT", "FAULT"], 10, "both arms are in FAULT")
            faults = running.status()["arms"][0]["faults"]
            found["state"] = f"FAULT ({faults}), drives {', '.join(states)}"
            for was, now in zip(stood, Sampler(self).look()["position"]):
                self.assertLess(abs(was - now), 0.01, "it moved when the process came back")
            self.judge(victim, "SIGSTOP", found)
            self.assert_ok(running.robot("disable"))
            self.await_ready(running)

    def test_killed(self):
        for victim in ("planning", "control", "hal"):
            running = self.moving()
            found = self.measure(running, victim, signal.SIGKILL)
            found["state"] = f"all processes ended, drives {', '.join(self.torque_goes())}"
            self.judge(victim, "SIGKILL", found)
            running.event("died", 10)
            running.event("stopped", 20)
            running.close()
            system.until(lambda: not system.processes_of(str(running.path)), 5, "no process is left")


class Document(system.SystemTest):
    """docs/fault-matrix.md covers all measurements."""

    def test_rows(self):
        text = DOCUMENT.read_text()
        for where, fault, value in DEVICES:
            self.assertIn(f"| {where} | `{fault}`{f' {value:g}' if value else ''} |", text)
        for victim in PROCESSES:
            for name in ("SIGKILL", "SIGSTOP"):
                self.assertIn(f"| {name} | `{victim}` |", text)


def number(value, digits=0):
    return "-" if value is None else f"{value:.{digits}f}"


def device_line(row, report):
    where, fault, value = row["key"]
    budget = DEVICES[row["key"]]
    travel = None if budget.noticed is None else budget.travel(report["speed_mm_per_s"])
    cells = [where, f"`{fault}`{f' {value:g}' if value else ''}", number(row["noticed"]),
             number(budget.noticed), number(row["standing"]), number(row["travel"], 2),
             number(travel, 2), number(row["turn"], 2),
             ", ".join(row["guards"]) or "-", budget.reason]
    return f"| {' | '.join(cells)} |"


def end_title(row):
    return f"| {row['mode']} | {row['watch']} | {row['lost']} |"


def end_line(row):
    standing = "goes on for 3 s" if row["standing_ms"] < 0 else number(row["standing_ms"])
    bound = "none" if row["bound_mm"] is None else number(row["bound_mm"], 2)
    return f"{end_title(row)} {standing} | {number(row['travel_mm'], 2)} | {bound} |"


def process_line(row):
    cells = [row["signal"], f"`{row['victim']}`", number(row["stopping"]), number(row["budget"]),
             number(row["standing"]), number(row["powerless"]), number(row["travel"], 3),
             number(row["turn"], 3), row["state"],
             PROCESSES[row["victim"]].reason]
    return f"| {' | '.join(cells)} |"


def document():
    report = measured["report"]
    text = (pathlib.Path(__file__).parent / "document.md").read_text()
    processes = sorted(measured["processes"], key=lambda row: (row["signal"], row["victim"]))
    return text.format(period=report["period_ms"], speed=report["speed_mm_per_s"], turn=report["speed_deg_per_s"],
                       runs=report["runs"], rate=1 / CONTROL_PERIOD, heartbeat=DRIVE_HEARTBEAT_MS,
                       devices="\n".join(device_line(row, report) for row in measured["devices"]),
                       ends="\n".join(end_line(row) for row in report["ends"]),
                       processes="\n".join(process_line(row) for row in processes))


if __name__ == "__main__":
    write = "--write" in sys.argv
    if write:
        sys.argv.remove("--write")
        sys.argv += ["Devices", "Processes"]
        atexit.register(lambda: DOCUMENT.write_text(document()))
    system.main()
