#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Control at 1 kHz in motion, with the operator's page open on the same machine.

Simulator and control have the real-time priorities that systemd gives them (docs/deployment.md), and the default budgets. Without the
right to priorities both run as on any desktop: default scheduling, wide budgets. A browser without graphics hardware loads all
processors, so it runs at idle priority: the page may wait. TANDEM_BESIDE is the duration, s (default 60); a third of that precedes it
without a page. Since the machine is shared, late cycles of both are reported, not asserted."""
import json
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration" / "harness"))
import system  # noqa: E402  pylint: disable=wrong-import-position

SECONDS = float(os.environ.get("TANDEM_BESIDE", "60"))
# The kernel divides processor time by session first: both priorities must be low.
IDLE = """#!/bin/sh
echo 19 > /proc/self/autogroup 2> /dev/null
exec chrt --idle 0 "$TANDEM_REAL_BROWSER" "$@"
"""


class Beside(system.SystemTest):
    def open_page(self, deployment):
        browser = self.folder / "browser"
        browser.write_text(IDLE)
        browser.chmod(0o755)
        setting = {"bin": str(pathlib.Path(system.executable()).parent), "deployment": str(deployment),
                   "port": system.free_port(), "page": os.environ["TANDEM_PAGE"], "browser": str(browser)}
        page = subprocess.Popen(["node", str(HERE / "beside.js"), json.dumps(setting)], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True,
                                env={**os.environ, "TANDEM_REAL_BROWSER": os.environ.get("TANDEM_CHROMIUM", "/usr/bin/chromium")})
        self.addCleanup(system.reap, page)
        self.assertEqual(page.stdout.readline().strip(), "open")
        return page

    def move(self, running, ways, seconds, name):
        """Back and forth; prints the cycles that control missed. @return the last status"""
        before = running.status()["control"]
        began, runs = time.monotonic(), 0
        while time.monotonic() - began < seconds or runs % 2:
            self.assert_ok(running.robot("run", ways[runs % 2]))
            runs += 1
        status = running.status()
        control = status["control"]
        cycles, late = (control[key] - before[key] for key in ("cycles", "overruns"))
        print(f"  {name}: {time.monotonic() - began:.0f} s, {runs} runs, {late} of {cycles} cycles overran ({1e2 * late / cycles:.2f} %); "
              f"since the start: latest wake-up {1e3 * control['jitter_max_s']:.2f} ms late, "
              f"longest cycle {1e3 * control['cycle_time_max_s']:.2f} ms", flush=True)
        return status

    def test_1_khz_beside_the_page(self):
        real_time = system.may_have_priorities()
        running = self.start("laptop-1khz", **system.real_time())
        ways = [self.trajectory(name, [0, way, 0], following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=10)
                for name, way in (("there", 8), ("back", -8))]
        print(f"  {'real-time priorities, default budgets' if real_time else 'default scheduling, wide budgets'}")
        self.move(running, ways, SECONDS / 3, "without a page")
        page = self.open_page(running.path)
        status = self.move(running, ways, SECONDS, "with the page")
        reported, _ = page.communicate(timeout=60)
        self.assertEqual(page.returncode, 0)
        seen = json.loads(reported.splitlines()[-1])
        print(f"  page: frames per second {seen['frames']}; its server: {seen['server_cpu']:.2f} of a core, "
              f"{1e-3 * seen['bytes_per_second']:.0f} kB/s, {seen['dropped']} messages left out", flush=True)
        self.assertEqual([arm["faults"] for arm in status["arms"]], ["none", "none"])
        self.assertGreater(seen["frames"]["median"], 1, "the page stood still")


if __name__ == "__main__":
    system.main()
