# SPDX-License-Identifier: Apache-2.0
"""Random processes are killed, frozen or ended at a random time of a motion, and restarted individually while the others continue: the
robot stops in time, nothing moves without a command afterwards, and the next run works.

TANDEM_DEEDS is the number of faults (default 20). The seed of the run is printed, and each fault depends only on that seed and its own
number: TANDEM_SEED=N repeats a run, and TANDEM_SEED=N TANDEM_ONLY=K repeats its fault K alone."""
import collections
import os
import pathlib
import random
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PERIOD = 0.05             # s, of control
RAMP = 5e-3 / 0.1         # s: V_max over the deceleration of a stop
MACHINE = 0.75            # s: greatest delay by a busy machine and the polling of it
# Twice the default, so that a busy machine causes no faults.
DEPLOYMENT_BUDGETS = "{minimum_age_ms: 300, planning_reference_ms: 500, lease_ms: 2000}"
PROGRAMS = ("sim", "control", "planning")
# s, from the fault to the start of the stop ramp: age of a command, a reference, a client's heartbeat. The simulated arms themselves end
# with their process.
BUDGETS = {"control": 0.3, "planning": 0.5 + 2 * PERIOD, "client": 2.0 + PERIOD, "sim": 0.0}


def shared_memory():
    return {path.name for path in pathlib.Path("/dev/shm").iterdir() if "fastrtps" in path.name or "fastdds" in path.name}


class Parts:
    """The processes of a deployment, started individually as by a service manager."""

    def __init__(self, path):
        self.path, self.inside = path, ()
        self.running = {}
        for name in PROGRAMS:
            self.start(name)
        self.watcher = system.Watcher(path)

    def start(self, name):
        self.running[name] = subprocess.Popen(
            [system.executable(f"tandem-{name}"), "--deployment", str(self.path), "--log", "critical"], start_new_session=True)

    def end(self, name, how):
        process = self.running[name]
        process.send_signal(how)
        return process.wait(10)

    def status(self, *parts):
        return self.watcher.status(parts=parts or None)

    def joints(self):
        return [arm["joints"] for arm in self.status("state")["arms"]]

    def robot(self, *words):
        return system.run("robot", "--deployment", self.path, *words)

    def close(self):
        self.watcher.close()
        for process in self.running.values():
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.kill()
                process.wait()


class Anywhen(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.seed = system.seeded(self).getrandbits(32)
        self.shared_before = shared_memory()
        self.parts = Parts(system.deployment(self.folder, "laptop", control_period_s=PERIOD,
                                             budgets=DEPLOYMENT_BUDGETS))
        self.addCleanup(self.parts.close)
        system.until(lambda: len(self.parts.status()["arms"]) == 2, 20, "all processes talk")

    def begin_run(self):
        self.assert_ok(self.parts.robot("enable"))
        self.client = self.start_run(self.parts, self.long_line())
        first = self.parts.joints()
        system.until(lambda: self.client.poll() is not None or self.parts.joints() != first, 15, "the arms move")
        if self.client.poll() is not None:
            self.fail(f"the run ended early: {self.client.communicate()}")

    def assert_stands(self, name, since):
        """Within the budget the joints reach their final positions."""
        last = self.parts.joints()
        for _ in range(60):
            looked = time.monotonic()
            now = self.parts.joints()
            if now == last:
                self.assertLess(looked - since, BUDGETS[name] + RAMP + MACHINE)
                return
            last = now
        self.fail("the arms go on moving")

    def do(self, name, deed):
        process = self.client if name == "client" else self.parts.running[name]
        since = time.monotonic()
        if deed == "freeze":
            process.send_signal(signal.SIGSTOP)
        elif deed == "kill":
            process.kill()
            process.wait(10)
        else:
            process.terminate()
            process.wait(10)
        if name != "sim":
            self.assert_stands(name, since)
        if deed == "freeze":
            time.sleep(max(0.0, BUDGETS[name] + 0.3 + self.random.uniform(0.0, 0.5) - (time.monotonic() - since)))
            process.send_signal(signal.SIGCONT)
        elif name != "client":
            self.parts.start(name)

    def assert_recovers(self):
        """All processes communicate again, no arm is ENABLED, nothing moves; `disable` clears latched faults."""
        def at_rest():
            try:
                arms = self.parts.status()["arms"]
            except AssertionError:
                return False  # a restarted process is not received yet
            return len(arms) == 2 and all(arm["operating_state"] in ("FAULT", "DISABLED", "PAUSED") for arm in arms)

        system.until(at_rest, 30, "no arm is ENABLED")
        first = self.parts.joints()
        self.assertEqual(first, self.parts.joints(), "a joint moves by itself")
        system.reap(self.client)
        self.assert_ok(self.parts.robot("disable"))
        self.assertEqual([arm["operating_state"] for arm in self.parts.status()["arms"]], ["DISABLED"] * 2)

    def numbers(self):
        """Numbers of the faults to do."""
        only = os.environ.get("TANDEM_ONLY")
        return range(int(os.environ.get("TANDEM_DEEDS", "20"))) if only is None else [int(only)]

    def test_random_processes_fail_at_random_times(self):
        deeds = collections.Counter()
        for number in self.numbers():
            self.random = random.Random(f"{self.seed}/{number}")
            name = self.random.choice((*PROGRAMS, "client"))
            deed = self.random.choice(("kill", "freeze", "end"))
            try:
                self.begin_run()
                time.sleep(self.random.uniform(0.0, 0.5))  # at any time of the motion
                self.do(name, deed)
                self.assert_recovers()
            except BaseException:
                print(f"  {deed} {name}; TANDEM_ONLY={number} with the seed above repeats this fault", flush=True)
                raise
            deeds[f"{deed} {name}"] += 1
        print(f"  {dict(deeds)}", flush=True)
        for name in PROGRAMS:
            self.assertEqual(self.parts.end(name, signal.SIGTERM), 0, name)
        self.assertEqual(shared_memory() - self.shared_before, set(), "shared memory is left behind")


if __name__ == "__main__":
    system.main()
