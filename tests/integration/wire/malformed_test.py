# SPDX-License-Identifier: Apache-2.0
"""A raw writer on every topic of a running system: nothing crashes, nothing moves, and dropped samples are counted by topic.

TANDEM_ROUNDS is the number of rounds over all topics (default 25)."""
import json
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

ROUNDS = int(os.environ.get("TANDEM_ROUNDS", "25"))
LONG_BUDGETS = {"budgets": "{minimum_age_ms: 3000, planning_reference_ms: 5000, lease_ms: 9000}", "sim_period_ms": 5}
# Topics that each service must drop samples of.
READ_BY = {
    "tandem-sim": ["actuation/command", "sim/request", "stop"],
    "tandem-control": ["actuation/state", "planning/reference", "control/request", "stop", "arm_a/state_command",
                       "arm_b/state_command", "teleop/input", "arm_a/servo_cp", "arm_b/move_jp"],
    "tandem-planning": ["actuation/state", "control/status", "planning/request", "planning/compute"],
}


class Malformed(system.SystemTest):
    def test_every_topic(self):
        domain, prefix = system.free_domain(), f"t{os.getpid()}"
        running = self.start("laptop", domain=domain, prefix=prefix, **LONG_BUDGETS)
        self.assert_ok(running.robot("enable"))
        stood = running.joints()
        peer = pathlib.Path(system.executable()).parents[1] / "tests" / "raw_peer"
        random = system.seeded(self)
        dropped, missing = {}, READ_BY

        def bombard(only):
            environment = {**os.environ, "TANDEM_RAW_TOPICS": ",".join(only)} if only else None
            answer = subprocess.run([peer, str(domain), prefix, str(random.randrange(2**32)), str(ROUNDS), "arm_a", "arm_b"],
                                    capture_output=True, text=True, timeout=200, check=False, env=environment)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            did = json.loads(answer.stdout)
            print(did, flush=True)
            self.assertEqual(did["mistyped_matched"], 0, "samples of another type are taken")
            self.assertGreater(did["matched"], 0 if only else len(sum(READ_BY.values(), [])), "it was not received")
            self.assertIsNone(running.up.poll(), "a process died")
            self.assertEqual(running.assert_still(self, looks=3), stood, "an arm has moved")

        def all_named():
            nonlocal dropped, missing
            dropped = running.status()["dropped"]
            missing = [(who, topic) for who, topics in READ_BY.items() for topic in topics
                       if f"rt/{prefix}/{topic}" not in dropped.get(who, {})]
            return not missing

        # Fast DDS itself drops oversized samples, and those faster than a reader takes them: which process has some to count is random.
        for turn in range(6):
            bombard([f"rt/{prefix}/{topic}" for _, topic in missing] if turn > 1 else [])
            try:
                system.until(all_named, 5, "every process names what it has dropped")
                break
            except AssertionError:
                print(f"once more for {missing}", flush=True)
        self.assertTrue(all_named(), f"missing: {missing}; there are: {dropped}")
        print(dropped, flush=True)
        # The system continues normally.
        self.assert_ok(running.robot("disable"))
        system.until(lambda: running.status()["lease_owner"] == 0, 10, "a lease that was taken runs out")
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 2, 0], points=2)))


if __name__ == "__main__":
    system.main()
