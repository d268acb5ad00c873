# SPDX-License-Identifier: Apache-2.0
"""`tandem status --follow` on a terminal: a table with states, tips and the time that a trajectory still takes."""
import os
import pathlib
import pty
import re
import select
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

COLOUR = re.compile(r"\x1b\[\d*m")


class Terminal:
    """A command on a pseudo-terminal."""

    def __init__(self, *words, environment=None):
        self.ours, theirs = pty.openpty()
        self.process = subprocess.Popen([system.executable(), *map(str, words)], stdin=theirs, stdout=theirs, stderr=theirs,
                                        start_new_session=True, env={**os.environ, **(environment or {})})
        os.close(theirs)
        self.text = ""

    def until(self, what, seconds=30):
        """The first screen, as text with colours, of which what(screen without colours) is true."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if select.select([self.ours], [], [], 0.2)[0]:
                self.text += os.read(self.ours, 65536).decode()
            screens = self.text.split("\x1b[H\x1b[J")
            for screen in screens[:-1]:  # the last may be incomplete
                if what(COLOUR.sub("", screen)):
                    return screen
            self.text = "\x1b[H\x1b[J" + screens[-1]
        raise AssertionError(f"not shown within {seconds} s; the last screen:\n{self.text}")

    def close(self):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(10)
        finally:
            self.process.kill()
            os.close(self.ours)


class StatusTable(system.SystemTest):
    def follow(self, path, **environment):
        terminal = Terminal("status", path, "--follow", environment=environment)
        self.addCleanup(terminal.close)
        return terminal

    def test_states_tips_and_time(self):
        path = system.deployment(self.folder, "laptop", **system.real_time())
        with system.System(path) as robot:
            terminal = self.follow(path)
            screen = terminal.until(lambda text: "arm_a" in text and "not known" not in text)
            self.assertIn("\x1b[1mDISABLED", screen)
            tips = [arm["tip_m"] for arm in robot.status()["arms"]]
            for name, tip in zip(("arm_a", "arm_b"), tips):
                line = next(line for line in COLOUR.sub("", screen).splitlines() if line.startswith(name))
                for shown, metres in zip(line.split()[2:5], tip):
                    self.assertAlmostEqual(float(shown), 1e3 * metres, delta=0.02)
            run = system.client(path, "run", "circle")
            self.addCleanup(system.reap, run)
            screen = terminal.until(lambda text: re.search(r"running, point \d+ of 100, about \d+ s left", text))
            self.assertIn("\x1b[32mENABLED", screen)
            run.send_signal(signal.SIGINT)
            run.wait(20)
            self.assert_ok(robot.robot("stop"))
            screen = terminal.until(lambda text: "FAULT" in text)
            self.assertIn("\x1b[31mFAULT", screen)
            plain = self.follow(path, NO_COLOR="1").until(lambda text: "arm_a" in text)
            self.assertNotIn("\x1b[", plain)
            self.assertTrue(all(len(line) <= 120 for line in plain.splitlines()), plain)


if __name__ == "__main__":
    system.main()
