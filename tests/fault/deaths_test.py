# SPDX-License-Identifier: Apache-2.0
"""A process that dies while the arms move: `tandem up` says which one and when the arms stand, ends the others and exits 1; a new start
finds the arms DISABLED."""
import os
import pathlib
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402
from operated import Operator  # noqa: E402

ATTEMPTS = 5  # to have arms in motion: the host may be late for longer than the default budgets


class Deaths(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop", control_period_s=0.05)

    def begin_motion(self):
        operator = Operator(self, self.system)
        for _ in range(ATTEMPTS):
            if operator.begin_motion(self.long_line()):
                return operator.client
            operator.end_motion()
        self.fail(f"the arms do not move: {operator.why}")

    def death(self, name):
        client = self.begin_motion()
        victim = self.system.pids[name]
        os.kill(victim, signal.SIGKILL)
        died = self.system.event("died", 20)
        self.assertEqual((died["process"], died["pid"]), (name, victim))
        self.assertIn("killed by signal 9", died["text"])
        if name != "sim":  # the simulated arms end with their process
            self.system.event("standing", 20)
        self.system.event("stopped", 20)
        self.assertEqual(self.system.up.wait(10), 1)
        self.system.end_watch()
        self.assertNotIn("moving", [event["event"] for event in self.system.events])
        client.communicate(timeout=20)
        self.assertEqual(client.returncode, 1)
        self.assert_nothing_left()
        self.starts_anew()

    def starts_anew(self):
        """On the same domain, at once: all processes run, and nothing moves without a command. The next death shows that a run works."""
        again = system.System(self.system.path)
        self.addCleanup(again.close)
        self.assertEqual(again.states(), ["DISABLED", "DISABLED"])
        still = again.assert_still(self)
        self.assertEqual([joints[:3] for joints in still], [[-0.15, -0.10, -0.05], [-0.13, -0.12, -0.10]])
        self.system = again

    def test_one_after_the_other(self):
        for name in ("control", "planning", "sim"):
            print(f"  {name}", flush=True)
            self.death(name)
        self.begin_motion()


if __name__ == "__main__":
    system.main()
