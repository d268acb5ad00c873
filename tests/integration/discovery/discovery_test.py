# SPDX-License-Identifier: Apache-2.0
"""Discovery: two robots in one domain, and a discovery server in place of peers."""
import os
import pathlib
import signal
import socket
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

# For a loaded machine.
LONG_BUDGETS = {"budgets": "{minimum_age_ms: 3000, planning_reference_ms: 5000, lease_ms: 9000}", "sim_period_ms": 5}


class Discovery(system.SystemTest):
    def robot(self, name, **changes):
        folder = self.folder / name
        folder.mkdir()
        running = system.System(system.deployment(folder, "laptop", **LONG_BUDGETS, **changes))
        self.addCleanup(running.close)
        return running

    def test_two_robots_in_one_domain_do_not_disturb_each_other(self):
        domain = system.free_domain()
        one, two = (self.robot(name, domain=domain, prefix=f"{name}_{os.getpid()}") for name in ("one", "two"))
        stood = two.joints()
        self.assert_ok(one.robot("enable"))
        self.assert_ok(one.robot("run", self.trajectory("short", [0, 2, 0], points=2)))
        self.assertEqual(two.states(), ["DISABLED"] * 2)
        self.assertEqual(two.joints(), stood)
        self.assertNotEqual(one.joints(), stood)
        self.assert_ok(two.robot("enable"))
        self.assert_ok(one.robot("stop"))
        system.until(lambda: one.states() == ["FAULT"] * 2, 10, "one is stopped")
        self.assertEqual(two.states(), ["ENABLED"] * 2, "the stop of one is obeyed by the other")

    def test_a_server_introduces_processes_which_then_do_without_it(self):
        running = self.robot("served", discovery=f"{{server: 127.0.0.1, port: {system.free_port(socket.SOCK_DGRAM)}}}")
        self.assertEqual(set(running.pids), {"discovery", "sim", "control", "planning", "recorder"})
        self.assert_ok(running.robot("enable"))
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 2, 0], points=2)))
        running.status()  # all processes are discovered
        os.kill(running.pids["discovery"], signal.SIGSTOP)
        try:
            running.assert_still(self, looks=3)
            answer = running.robot("disable", timeout=60)
            self.assertEqual(answer.returncode, 1, "who comes while the server is away meets nobody")
            self.assertIn("not running or not connected", answer.stderr)
        finally:
            os.kill(running.pids["discovery"], signal.SIGCONT)
        self.assert_ok(running.robot("disable"))

    def test_a_server_has_to_be_somewhere(self):
        for server, reason in (("robot", "expected an IPv4 address"), ("300.1.1.1", "expected an IPv4 address")):
            path = system.deployment(self.folder, "laptop", discovery=f"{{server: {server}}}")
            answer = system.run("validate", path)
            self.assertNotEqual(answer.returncode, 0)
            self.assertIn(reason, answer.stdout + answer.stderr)


if __name__ == "__main__":
    system.main()
