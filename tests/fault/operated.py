# SPDX-License-Identifier: Apache-2.0
"""An operator of a robot whose cycles are logged: every request is noted with its time, for the judges of cycles.py."""
import contextlib
import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import cycles  # noqa: E402
import system  # noqa: E402


class Operator:
    """Enables, moves and disables `robot`, an object with robot(), joints(), status(), path and inside."""

    def __init__(self, test, robot):
        self.robot, self.windows = robot, cycles.Windows()
        self.client, self.why, self._test, self._moving_since = None, "", test, None

    def ask(self, what, *words):
        begin = time.monotonic()
        answer = self.robot.robot(what, *words)
        self.windows.add(what, begin, time.monotonic())
        return answer

    def begin_motion(self, trajectory):
        """Whether a trajectory moves the arms. False if a fault came before, which the judges explain or refute: `why` says it."""
        answer = self.ask("enable")
        if answer.returncode != 0:
            self.why = answer.stderr
            return False
        self._moving_since = time.monotonic()
        self.client = self._test.start_run(self.robot, trajectory)
        stood = self.robot.joints()
        system.until(lambda: self.client.poll() is not None or self.robot.joints() != stood, 30, "the arms move or the client ends")
        if self.client.poll() is not None:
            self.why = self.client.communicate()[1]
        return self.client.poll() is None

    def end_motion(self):
        """The client has ended, faults are cleared, and all arms are DISABLED."""
        if self.client is not None:
            self.client.send_signal(signal.SIGINT)  # Ctrl-C; it may have ended
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.client.wait(5)
            system.reap(self.client)
            self.client = None
        system.until(lambda: self.ask("disable").returncode == 0, 60, "`disable` is obeyed")
        system.until(lambda: self.robot.status()["lease_owner"] == 0, 30, "the lease is free, given back or lost")
        if self._moving_since is not None:
            self.windows.add("motion", self._moving_since, time.monotonic())
            self._moving_since = None
