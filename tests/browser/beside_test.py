#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Control at 1 kHz, moving, with the operator's page open on the same machine.

A browser without graphics hardware takes every processor that it gets, so it runs at idle priority: a page is what may
wait. TANDEM_BESIDE says for how long, s (default 60). The machine is anybody's: late cycles are reported, not judged."""
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
BUDGETS = os.environ.get("TANDEM_BUDGETS", "{minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 2000}")
# Processes of one session share what the kernel gives to the session: both have to be modest.
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

    def test_1_khz_beside_the_page(self):
        running = self.start("laptop-1khz", budgets=BUDGETS)
        page = self.open_page(running.path)
        ways = [self.trajectory(name, [0, way, 0], following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=10)
                for name, way in (("there", 8), ("back", -8))]
        began, runs = time.monotonic(), 0
        while time.monotonic() - began < SECONDS or runs % 2:
            self.assert_ok(running.robot("run", ways[runs % 2]))
            runs += 1
        status = running.status()
        told, _ = page.communicate(timeout=60)
        self.assertEqual(page.returncode, 0)
        seen = json.loads(told.splitlines()[-1])
        control = status["control"]
        print(f"  {time.monotonic() - began:.0f} s, {runs} runs, {control['cycles']} cycles of control: {control['overruns']} overruns, "
              f"latest wake-up {1e3 * control['jitter_max_s']:.2f} ms late, longest cycle {1e3 * control['cycle_time_max_s']:.2f} ms")
        print(f"  page: frames per second {seen['frames']}; its server: {seen['server_cpu']:.2f} of a core, "
              f"{1e-3 * seen['bytes_per_second']:.0f} kB/s, {seen['dropped']} messages left out", flush=True)
        self.assertEqual([arm["faults"] for arm in status["arms"]], ["none", "none"])
        self.assertGreater(seen["frames"]["median"], 1, "the page stood still")


if __name__ == "__main__":
    system.main()
