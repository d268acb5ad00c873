# SPDX-License-Identifier: Apache-2.0
"""Test of the packages on a separate machine: its systemd starts the services, a script records their state, and this module checks it."""
import re

import uml

LIMIT = 900  # s, from power on to power off
PRIORITY = 70  # of the periodic thread; above those of the units
# For a virtual machine with one slow processor, as in `tests/integration/hal/hardware.py`.
SLOW_BUDGETS = "{minimum_age_ms: 5000, planning_reference_ms: 10000, drive_heartbeat_ms: 3000}"


def leave_out(target, name, times):
    """Removes processes from a deployment."""
    text, count = re.subn(rf"  - (?:\{{name: {name},.*\n|name: {name}\n(?:    .*\n)+)", "", target.read_text())
    assert count == times, f"{target}: {name}"
    target.write_text(text)


def edit(source, target, changes, more=""):
    text = source.read_text()
    for key, value in changes.items():
        text, count = re.subn(rf"^{key}:.*$", f"{key}: {value}", text, flags=re.M)
        assert count == 1, f"{source}: {key}"
    target.write_text(text + more)


def bench(share, etc, more):
    """Deployment `bench`: the HAL, with simulated drives on CAN interfaces."""
    hardware = (share / "hardware/ark2024-two-buses.yaml").read_text()
    for old, new in (("../robots/ark2024.yaml", "ark2024"), ("unix:/tmp/tandem-bus-a", "can:vcan0"),
                     ("unix:/tmp/tandem-bus-b", "can:vcan1"), ("period_ms: 4\n", "period_ms: 20\n"),
                     ("feedback_budget_ms: 300", "feedback_budget_ms: 900")):
        assert old in hardware, old
        hardware = hardware.replace(old, new)
    (etc / "hardware/bench.yaml").write_text(hardware)
    target = etc / "deployments/bench.yaml"
    edit(share / "deployments/drives.yaml", target,
         {"name": "bench", "robot": "ark2024", "hardware": "bench", "budgets": SLOW_BUDGETS}, more)
    # Here the drives are not processes of the deployment.
    leave_out(target, "drives-[ab]", 2)
    leave_out(target, "console", 1)


class Boot:
    """Boots, runs guest.sh, which records the state, powers off; then checks the record."""

    def __init__(self, test, root):
        self.test, self.root = test, root.path
        self.machine = uml.Machine(root.path, "guest.sh", "1500M")

    def run(self):
        self.prepare()
        try:
            self.machine.boot(LIMIT)
            self.judge()
        finally:
            self.clean()

    def prepare(self):
        self.machine.prepare()
        self.machine.prepare_modules()
        share, etc = self.root / "usr/share/tandem", self.root / "etc/tandem"
        realtime = f"realtime_priority: {PRIORITY}\nlock_memory: true\n"
        # User-mode Linux has one processor, and a system call costs as much there as sixteen elsewhere, on some hosts as eighty. With these
        # periods the idle system takes 5 % of the processor (12 % at 100 ms), and planning keeps its watchdog on a host a few times slower.
        edit(share / "deployments/laptop.yaml", etc / "deployments/boot.yaml",
             {"name": "boot", "robot": "ark2024", "sim_period_ms": "500", "control_period_s": "1", "status_period_ms": "2000",
              "teleoperation": "{crtk: {commands: false}}"}, f"{realtime}budgets: {SLOW_BUDGETS}\n")
        leave_out(etc / "deployments/boot.yaml", "recorder", 1)  # it takes a third of the one processor
        leave_out(etc / "deployments/boot.yaml", "console", 1)
        bench(share, etc, realtime)
        (etc / "deployments/wrong.yaml").write_text("tandem: deployment/1\nname: wrong\nrobot: nowhere\n")

    def judge(self):
        seen = self.machine.results()
        print(seen, flush=True)
        try:
            self.judge_services(seen)
        except (AssertionError, KeyError, ValueError):
            print(self.machine.story(), flush=True)
            raise

    def judge_services(self, seen):
        test = self.test
        test.assertIn("end", seen)

        def same(expected, *keys):
            for key in keys:
                test.assertEqual(seen.get(key), expected, key)

        same("active", "target", "sim_active", "control_active", "planning_active")
        for name, policy in (("sim", "SCHED_FIFO 30"), ("control", "SCHED_FIFO 20"), ("planning", "SCHED_FIFO 10")):
            test.assertIn(policy, seen[f"{name}_threads"], name)
        same("yes", "periodic")
        for name in ("sim", "control"):
            test.assertIn(f"SCHED_FIFO {PRIORITY}", seen[f"{name}_threads"], name)
            test.assertNotIn("SCHED_OTHER", seen[f"{name}_threads"], name)
            test.assertGreater(int(seen[f"{name}_locked"]), 10000, "kB")
        for name in ("sim", "control", "planning"):
            same("tandem", f"{name}_user")
            same("0000000000000000", f"{name}_capabilities")
            same("1", f"{name}_no_new_privileges")
            same("read-only", f"{name}_usr", f"{name}_etc")
        self.judge_watchdog(same)
        same("2 0", "wrong_file")
        same("inactive", "sim_stopped", "control_stopped", "planning_stopped")
        same("success", "sim_result", "control_result", "planning_result")
        self.judge_drives(seen, same)

    @staticmethod
    def judge_watchdog(same):
        """A control process that hangs is killed and restarted, and no other one. What the arms do meanwhile is tested by the tests in
        `tests/fault`: on a slow host a DDS client in this machine needs minutes to discover the system, and takes its processor."""
        same("1", "control_restarts")
        same("0", "sim_restarts", "planning_restarts")
        same("yes", "watchdog_said")

    def judge_drives(self, seen, same):
        """The HAL communicates with drives, with no more rights than its unit grants."""
        same("active", "hal_active")
        same("0000000000001000", "hal_capabilities")  # CAP_NET_ADMIN
        same("tandem", "hal_user")
        same("read-only", "hal_usr", "hal_etc")
        for words in ("SCHED_FIFO 30", f"SCHED_FIFO {PRIORITY}"):
            self.test.assertIn(words, seen["hal_threads"])
        same("success inactive", "hal_end")
        self.test.assertGreater(int(seen["frames"]), 500, "on each bus")

    def clean(self):
        """Removes the files that this test and the booted machine have created; the packages' test continues."""
        self.machine.clean()
        for path in ("deployments/boot.yaml", "deployments/wrong.yaml", "deployments/bench.yaml", "hardware/bench.yaml"):
            (self.root / "etc/tandem" / path).unlink(missing_ok=True)
