# SPDX-License-Identifier: Apache-2.0
"""The whole system at 1 kHz with the page open: whether the loops keep their deadlines beside it, and what the page costs.

TANDEM_SOAK says how long, s (default 60). Periodic threads have real-time priority, as on a robot; a browser that draws in software
takes all the rest of a small machine."""
import json
import os
import pathlib
import socket
import subprocess
import sys
import threading

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration" / "harness"))
import system  # noqa: E402  pylint: disable=wrong-import-position

SECONDS = int(os.environ.get("TANDEM_SOAK", "60"))


class Soak(system.SystemTest):
    def test_the_loops_beside_the_page(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        running = self.start("laptop-1khz", realtime_priority=40, lock_memory="true")
        console = subprocess.Popen([system.executable("tandem-console"), "--deployment", str(running.path), "--port", str(port),
                                    "--page", os.environ["TANDEM_PAGE"], "--log", "warn"])
        self.addCleanup(console.wait, 10)
        self.addCleanup(console.terminate)
        setting = {"url": f"http://127.0.0.1:{port}", "seconds": SECONDS,
                   "browser": os.environ.get("TANDEM_CHROMIUM", "/usr/bin/chromium")}
        system.until(lambda: socket.socket().connect_ex(("127.0.0.1", port)) == 0, 20, "the console answers")
        seen = {}

        def look():
            answer = subprocess.run(["node", str(HERE / "soak.js"), json.dumps(setting)], capture_output=True, text=True,
                                    timeout=SECONDS + 120, check=False)
            seen["page"] = json.loads(answer.stdout) if answer.returncode == 0 else answer.stderr

        before = running.status()["control"]
        page = threading.Thread(target=look)
        page.start()
        there, runs = [0, 8, 0], 0
        while page.is_alive():
            line = self.trajectory(f"line-{runs % 2}", [(-1) ** runs * x for x in there], following="timed", speed_mm_per_s=2,
                                   acceleration_mm_per_s2=10)
            self.assert_ok(running.robot("run", line))
            runs += 1
        page.join()
        status = running.status()
        control = status["control"]
        self.assertIsInstance(seen["page"], dict, seen["page"])
        cycles, overruns = (control[key] - before[key] for key in ("cycles", "overruns"))
        print(f"  {runs} runs, {cycles} cycles of control at 1 kHz, {overruns} overruns, latest wake-up "
              f"{1e3 * control['jitter_max_s']:.2f} ms late", flush=True)
        print(f"  page: median {seen['page']['frames']} frames/s; server: {100 * seen['page']['cpu']:.0f} % of a core, "
              f"{seen['page']['bytes'] / 1e3:.0f} kB/s to one client", flush=True)
        self.assertEqual(seen["page"]["complaints"], [])
        self.assertEqual([arm["faults"] for arm in status["arms"]], ["none", "none"])
        self.assertLess(overruns, 0.01 * cycles)


if __name__ == "__main__":
    system.main()
