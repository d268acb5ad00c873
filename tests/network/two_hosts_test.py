# SPDX-License-Identifier: Apache-2.0
"""Console PC and robot PC: planning and clients on one host, simulator and control on the other.

TANDEM_CUTS is the number of link cuts (default 10)."""
import json
import os
import pathlib
import re
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "security"))
from credentials import Authority, system  # noqa: E402
import network  # noqa: E402

PRESET = "two-hosts"
CHANGES = {"sim_period_ms": 10, **system.real_time()}
REFERENCE_AGE = 1.0 if "budgets" in CHANGES else 0.25  # s without a reference
PERIOD = 0.1          # s, of control
POOR = {"delay": 0.02, "jitter": 0.01, "loss": 0.05, "duplicates": 0.05}
# Two samples in a row exceed the default age of a reference, and this wire loses two in a row every few seconds (docs/two-hosts.md).
POOR_BUDGETS = {"budgets": "{planning_reference_ms: 1000}"}
LACK = network.missing()


@unittest.skipIf(LACK, LACK)
class TwoHosts(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.robot_host = network.Host("robot", "192.168.77.1")
        self.addCleanup(self.robot_host.close)
        self.console_host = network.Host("console", "192.168.77.2")
        self.addCleanup(self.console_host.close)
        self.random = system.seeded(self)
        self.wire = network.Wire(self.robot_host, self.console_host, self.random.randrange(2**32))
        self.addCleanup(self.wire.close)
        self.path = system.deployment(self.folder, PRESET, **CHANGES)

    def start_robot(self, path=None, processes=("sim", "control", "recorder")):
        """Starts the robot host, which waits for the console."""
        self.log = self.folder / "robot.log"
        system.System.stderr = self.log.open("w")
        self.addCleanup(setattr, system.System, "stderr", None)
        self.addCleanup(system.System.stderr.close)
        self.addCleanup(lambda: print(self.log.read_text(), file=sys.stderr))
        self.robot = system.System(path or self.path, self.robot_host.inside, await_ready=False, parts=("state", "status"))
        self.addCleanup(self.robot.close)
        self.assertEqual(set(self.robot.pids), set(processes))
        self.robot.event("waiting", 20)

    def start_both(self, **changes):
        self.start_robot(**changes)
        self.console = system.System(self.path, self.console_host.inside)
        self.addCleanup(self.console.close)
        self.assertEqual(set(self.console.pids), {"planning"})
        self.robot.event("ready", 20)

    def test_an_experiment_runs_across(self):
        self.path = system.deployment(self.folder, PRESET, **{**POOR_BUDGETS, **CHANGES})
        self.start_robot()
        experiment = os.environ.get("TANDEM_EXPERIMENT") or system.short_experiment(self.folder, "nspqp")
        runs = {}
        for name, trouble in {"clean": {}, "poor": POOR}.items():
            self.trouble(trouble)
            folder = self.folder / name
            answer = system.run("experiment", experiment, "--deployment", self.path,
                                "--csv", folder, "--json", timeout=3600, inside=self.console_host.inside)
            self.assert_ok(answer)
            runs[name] = json.loads(answer.stdout)
            iterations = [row["iterations"] for row in runs[name]["rows"]]
            print(f"{name}: {self.wire.carried} frames carried, {self.wire.dropped} lost; iterations {iterations}", flush=True)
            for row in runs[name]["rows"]:
                self.assertEqual((row["converged"], row["limit_violations"]), (row["points"], 0), runs[name])

    def test_secured_hosts_work_together_over_a_poor_wire(self):
        """Each host has only the keys of its own processes; a client without keys receives nothing."""
        self.trouble(POOR)
        domain, prefix = system.free_domain(), f"t{os.getpid()}"
        authority = Authority(self.folder / "authority", prefix, domain)
        paths = {}
        for host, roles in (("robot", ("hal", "control", "recorder", "console-viewer")), ("console", ("planning", "console-operator"))):
            (self.folder / host).mkdir()
            paths[host] = system.deployment(self.folder / host, PRESET, **{**POOR_BUDGETS, **CHANGES}, domain=domain, prefix=prefix,
                                            security=authority.issue(*roles, to=self.folder / f"{host}-keys"))
        self.start_robot(paths["robot"])
        answer = self.assert_ok(system.run("experiment", system.short_experiment(self.folder, "nspqp"), "--deployment",
                                           paths["console"], "--csv", self.folder / "csv", "--json", timeout=300,
                                           inside=self.console_host.inside))
        for row in json.loads(answer.stdout)["rows"]:
            self.assertEqual((row["converged"], row["limit_violations"]), (row["points"], 0))
        bare = system.deployment(self.folder, PRESET, **CHANGES, domain=domain, prefix=prefix)
        stranger = system.run("status", bare, inside=self.console_host.inside)
        self.assertEqual(stranger.returncode, 1, stranger.stdout)
        self.assertIn("not running or not connected: sim (or hal), control, planning", stranger.stderr)

    def trouble(self, kinds):
        for key, value in kinds.items():
            setattr(self.wire, key, value)

    def standing(self):
        """The joints, if two statuses are equal: an arm in FAULT first decelerates."""
        first = self.robot.joints()
        return first if first == self.robot.joints() else None

    def ages(self):
        """Age of planning's last reference at each fault, s, by the clock of control."""
        return [float(age) for age in re.findall(r"arm_a: reference_timeout: (\S+) s", self.log.read_text())]

    def test_a_cut_link_stops_the_arms_until_a_client_enables_them(self):
        # Each of the many clients has to discover every reader of every process; most are the recorder's.
        self.path = system.deployment(self.folder, PRESET, without=["recorder"], **CHANGES)
        self.start_both(processes=("sim", "control"))
        clocks = system.until(lambda: (lambda found: len(found) == 2 and found)(self.console.status()["clocks"]), 10,
                              "both hosts tell the time")
        self.assertEqual({clock["host"] for clock in clocks}, {"robot", "console"})
        for clock in clocks:  # both hosts share one machine and its clock
            self.assertLess(abs(clock["offset_s"]), clock["within_s"] + 1e-4)
        for cut in range(int(os.environ.get("TANDEM_CUTS", "10"))):
            self.assert_ok(self.console.robot("enable"))
            run = self.start_run(self.console, self.long_line())
            self.robot.await_motion(run)
            time.sleep(self.random.uniform(0.0, 1.0))  # at any time of the motion
            self.wire.cut = True
            states = system.until(lambda: (lambda s: s == ["FAULT"] * 2 and s)(self.robot.states()), 20, "both arms are in FAULT")
            stood = system.until(self.standing, 20, "the arms stand")
            self.assertEqual(states, ["FAULT", "FAULT"])
            # Control's own clock: the polls of a loaded machine take seconds.
            system.until(lambda: len(self.ages()) > cut, 10, "control logs its fault")
            age = self.ages()[-1]
            self.assertLess(age, REFERENCE_AGE + 2 * PERIOD, f"cut {cut}")
            self.robot.assert_still(self)
            self.wire.cut = False
            _, errors = run.communicate(timeout=30)
            self.assertEqual(run.returncode, 1, errors)
            # The link is restored, the console receives the robot, and nothing moves.
            self.assertEqual(self.console.status()["arms"][0]["operating_state"], "FAULT")
            self.assertEqual(self.robot.assert_still(self, looks=3), stood, "the arms moved after the link was restored")
            self.assert_ok(self.console.robot("disable"))
            self.assertEqual(self.robot.states(), ["DISABLED", "DISABLED"])
            print(f"cut {cut}: FAULT at {age:.3f} s without a reference; {errors.strip().splitlines()[-1]}", flush=True)
        short = self.trajectory("short", [0, 2, 0], points=2)
        self.assert_ok(self.console.robot("run", short))

    def test_a_machine_that_is_none_of_the_hosts_is_refused(self):
        answer = system.run("up", self.path)
        self.assertNotEqual(answer.returncode, 0)
        for words in ("robot 192.168.77.1, console 192.168.77.2", "127.0.0.1"):
            self.assertIn(words, answer.stderr)


if __name__ == "__main__":
    system.main()
