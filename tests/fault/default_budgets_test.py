# SPDX-License-Identifier: Apache-2.0
"""The default budgets of docs/safety.md with real processes at 250 Hz and 1 kHz.

Processes are frozen for a little less and for more than a budget, killed and stopped while the arms move. Every cycle of every process is
judged on its own clock (cycles.py). The host may be late at any time: what it does to a process counts as an age like any other, so a
fault that it causes is judged like the others, and no budget is wider for it."""
import collections
import os
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "hal"))
import cycles  # noqa: E402
from hardware import HalTest, system  # noqa: E402
from operated import Operator  # noqa: E402

ATTEMPTS = 6  # of each deed to meet arms in motion, since the host may have stopped them before
DEEDS = {  # name: (process, signal, duration in s, faults of which one must latch)
    "control frozen for 60 ms": ("control", signal.SIGSTOP, 0.06, cycles.COMMAND_TIMEOUT | cycles.STALE_COMMAND | cycles.STATE_TIMEOUT),
    "sim frozen for 60 ms": ("sim", signal.SIGSTOP, 0.06, cycles.COMMAND_TIMEOUT | cycles.STALE_COMMAND | cycles.STATE_TIMEOUT),
    "planning frozen for 0.4 s": ("planning", signal.SIGSTOP, 0.4, cycles.REFERENCE_TIMEOUT),
    "client killed": ("client", signal.SIGKILL, 0.0, cycles.LEASE_LOST),
    "stop": ("stop", None, 0.0, cycles.STOP_REQUESTED),
}
SHORT = {"control": 0.01, "sim": 0.01, "planning": 0.1}  # s, below the budgets: no fault is due


class DefaultBudgets(system.SystemTest):
    def start_at(self, control_period, period):
        self.logs = self.folder / "cycles"
        self.budgets = cycles.Budgets(control_period, period)
        self.system = self.start("laptop", without=["recorder"], control_period_s=control_period, sim_period_ms=1e3 * period,
                                 realtime_priority=system.priority(), cycle_log=self.logs)
        self.operator = Operator(self, self.system)

    def do(self, name, how, duration):
        if name == "stop":
            self.assert_ok(self.system.robot("stop"))
        elif name == "client":
            self.operator.client.kill()
            system.until(lambda: self.system.status()["lease_owner"] == 0, 30, "the lease is lost")
        else:
            os.kill(self.system.pids[name], how)
            time.sleep(duration)
            os.kill(self.system.pids[name], signal.SIGCONT)

    def assert_latched(self, name):
        """The client says why it ends, and only `disable` leads out of FAULT."""
        if name != "client":
            errors = self.operator.client.communicate(timeout=30)[1]
            self.assertEqual(self.operator.client.returncode, 1)
            self.assertIn("FAULT", errors)
        for command in ("resume", "enable") if name == "stop" else ():
            self.assert_refused(self.system.robot(command), "FAULT", "disable")

    def stop_of_standing_arms(self):
        """`stop` does not wait for processes that it does not need."""
        self.operator.ask("enable")
        os.kill(self.system.pids["planning"], signal.SIGSTOP)
        try:
            self.assert_ok(self.system.robot("stop"))
        finally:
            os.kill(self.system.pids["planning"], signal.SIGCONT)
        system.until(lambda: set(self.system.states()) == {"FAULT"}, 30, "the arms are in FAULT")
        self.operator.end_motion()

    def deed(self, what, name, how, duration, is_fault=True):
        """Whether the deed met arms in motion."""
        met = self.operator.begin_motion(self.long_line())
        if met:
            began = time.monotonic()
            self.do(name, how, duration)
            if is_fault:
                system.until(lambda: set(self.system.states()) == {"FAULT"}, 30, "the arms stop")
                self.assert_latched(name)
            self.deeds.append((what, began, time.monotonic()))
        self.operator.end_motion()
        return met

    def judge_rate(self, control_period, period):
        self.deeds = []
        self.start_at(control_period, period)
        for name, duration in SHORT.items():
            self.deed(f"{name} frozen for {1e3 * duration:.0f} ms", name, signal.SIGSTOP, duration, is_fault=False)
        for what, (name, how, duration, _) in DEEDS.items():
            self.assertTrue(any(self.deed(what, name, how, duration) for _ in range(ATTEMPTS)),
                            f"{what}: in {ATTEMPTS} attempts a fault came before it")
        self.stop_of_standing_arms()
        self.system.close()
        judges = cycles.judged(self.logs, self.budgets, self.operator.windows)
        self.report(judges)
        self.assertEqual([text for judge in judges for _, text in judge.violations], [])
        for what, begin, end in self.deeds:
            if what in DEEDS:
                latched = cycles.latched_between(judges, begin, end)
                self.assertTrue(latched & DEEDS[what][3], f"{what}: the fault bits {latched} latched")

    def report(self, judges):
        for judge in judges:
            late = sorted(judge.log.late)
            faults = collections.Counter(faults for _, _, faults in judge.latches)
            stops = getattr(judge, "stops", [])
            longest = max((ramp for ramp, _ in stops), default=0.0), max((way for _, way in stops), default=0.0)
            print(f"  {judge.log.path.name.split('-')[0]}: {len(late)} cycles, late by {1e3 * late[len(late) // 2]:.2f} ms (median), "
                  f"{1e3 * late[int(0.999 * len(late))]:.1f} ms (99.9 %), {1e3 * late[-1]:.1f} ms (most); latched {dict(faults)}; "
                  f"longest stop {1e3 * longest[0]:.0f} ms, {1e3 * longest[1]:.3f} mm", flush=True)
        print(f"  deeds that met arms in motion: {[what for what, _, _ in self.deeds]}", flush=True)

    def test_250_hz(self):
        self.judge_rate(0.004, 0.001)

    def test_1_khz(self):
        self.judge_rate(0.001, 0.001)


class DefaultDriveBudgets(HalTest):
    """Drives behind the HAL at 250 Hz: 50 ms without a command PDO, 100 ms without a heartbeat, by the drives' own clocks."""

    budgets = "{drive_heartbeat_ms: 100}"
    feedback_budget_ms = 30
    DEADLINE, STEP = 0.05, 0.0015  # s; a drive looks at its deadline once per step of the simulation
    STOP = 0.2                     # s, from 10 mm/s by its quick stop, and its lag

    def test_the_drives_stop_by_themselves(self):
        for bus in "ab":
            self.drive_sim(bus)
        logs = self.folder / "cycles"
        self.system = self.start_hal(control_period_s=0.004, cycle_log=logs)
        self.operator = Operator(self, self.system)
        self.await_ready(self.system)
        self.assertTrue(any(self.freeze_hal(0.2) for _ in range(ATTEMPTS)), f"in {ATTEMPTS} attempts a fault came before the freeze")
        self.freeze_hal(0.02)
        self.system.close()
        judges = cycles.judged(logs, cycles.Budgets(0.004, 0.004), self.operator.windows)
        self.assertEqual([text for judge in judges for _, text in judge.violations], [])

    def freeze_hal(self, duration):
        """Whether it met arms in motion."""
        met = self.operator.begin_motion(self.long_line())
        if met:
            os.kill(self.system.pids["hal"], signal.SIGSTOP)
            time.sleep(duration)
            stopped = [drive for bus in "ab" for drive in self.drives(bus)]
            os.kill(self.system.pids["hal"], signal.SIGCONT)
            for drive in stopped:
                self.assertLessEqual(drive["longest_silence"], self.DEADLINE + self.STEP, drive)
                if duration > self.DEADLINE + self.STOP / 2:
                    self.assertGreaterEqual(drive["contact_losses"], 1, drive)
                    self.assertLessEqual(drive["stop_duration"], self.STOP, drive)
                    self.assertNotEqual(drive["state"], "operation enabled", drive)
        self.operator.end_motion()
        self.await_ready(self.system)
        return met


if __name__ == "__main__":
    system.main()
