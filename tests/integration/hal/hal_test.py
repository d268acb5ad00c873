# SPDX-License-Identifier: Apache-2.0
"""tandem-hal in front of two buses of simulated drives, driven by the command line; and `tandem can` on such a bus."""
import json
import os
import pathlib
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

# Function is tested here, on any machine, however busy; the time budgets have tests of their own in simulated time.
BUDGETS = ("{minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 2000, drive_heartbeat_ms: 1000}")


class HalTest(system.SystemTest):
    """Hardware and deployment of one's own; drives started by the test or by the deployment."""

    def setUp(self):
        super().setUp()
        preset = (system.PRESETS / "hardware" / "ark2024-two-buses.yaml").read_text()
        for bus in "ab":
            preset = preset.replace(f"unix:/tmp/tandem-bus-{bus}", f"unix:{self.socket(bus)}")
        preset = preset.replace("../robots/ark2024.yaml", str(system.PRESETS / "robots" / "ark2024.yaml"))
        self.hardware = self.folder / "hardware.yaml"
        self.hardware.write_text(preset.replace("feedback_budget_ms: 300", "feedback_budget_ms: 900"))

    def socket(self, bus):
        return self.folder / f"bus-{bus}"

    def control(self, bus):
        return self.folder / f"control-{bus}"

    def drive_sim(self, bus, *more):
        """Simulated drives of one bus, started by the test; ready when its control socket answers."""
        process = subprocess.Popen([system.executable("tandem-drive-sim"), "--hardware", str(self.hardware),
                                    "--hardware-bus", f"bus_{bus}", "--control", str(self.control(bus)), "--log",
                                    "warn", *more], start_new_session=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        system.until(lambda: self.tell(bus, "state", check=False).returncode == 0, 20, "the drives answer")
        return process

    def tell(self, bus, line, check=True):
        answer = system.run("--control", self.control(bus), "--send", line, program="tandem-drive-sim")
        if check:
            self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        return answer

    def drives(self, bus):
        return json.loads(self.tell(bus, "state").stdout)["drives"]

    def start_hal(self, with_drives=False):
        path = system.deployment(self.folder, "drives", hardware=self.hardware, budgets=BUDGETS)
        text = path.read_text().replace("[--hardware, ark2024-two-buses,", f"[--hardware, {self.hardware},")
        if not with_drives:
            lines, kept, skipping = text.splitlines(), [], False
            for line in lines:
                if line.startswith("  - "):
                    skipping = "drives-" in line
                elif not line.startswith("   "):
                    skipping = False
                if not skipping:
                    kept.append(line)
            text = "\n".join(kept) + "\n"
        path.write_text(text)
        started = system.System(path)
        self.addCleanup(started.close)
        return started

    def monitor(self, running):
        answer = self.assert_ok(system.run("can", "monitor", running.path, "--once", "--json"))
        return json.loads(answer.stdout)

    def await_ready(self, running):
        return system.until(lambda: (lambda m: all(arm["homed"] for arm in m["arms"]) and m)(self.monitor(running)),
                            30, "all axes know where they are")


class Can(HalTest):
    """`tandem can` where no master is."""

    def setUp(self):
        super().setUp()
        self.bus = f"unix:{self.socket('a')}"
        self.drive_sim("a")

    def test_scan_lists_who_is_there(self):
        found = json.loads(self.assert_ok(system.run("can", "scan", "--bus", self.bus, "--json")).stdout)
        self.assertEqual([node["node"] for node in found], [1, 2, 3, 4, 5, 6, 17, 18, 19, 20, 21, 22])
        self.assertEqual([node["profile"] for node in found], 6 * [402] + 6 * [406])
        self.assertEqual([node["serial"] for node in found], [1000 + node["node"] for node in found])
        self.assertEqual({node["drive_state"] for node in found[:6]}, {"switch on disabled"})
        self.assertIn("402 drive", self.assert_ok(system.run("can", "scan", "--bus", self.bus)).stdout)

    def test_objects_are_read_and_written(self):
        def od(*words):
            return system.run("can", "od", "--bus", self.bus, "--json", *words)

        self.assertEqual(json.loads(self.assert_ok(od("1", "1000")).stdout)["unsigned"] & 0xFFFF, 402)
        written = json.loads(self.assert_ok(od("1", "607D:1", "--", "-12345")).stdout)
        self.assertEqual((written["signed"], written["bytes"]), (-12345, 4))
        self.assertEqual(json.loads(self.assert_ok(od("1", "607D:1")).stdout)["signed"], -12345)
        self.assertIn("text", json.loads(self.assert_ok(od("1", "1008")).stdout))
        self.assert_refused(od("1", "5FFF"), "does not exist")
        self.assert_refused(od("1", "6041", "3"), "read")
        self.assert_refused(od("99", "1000"), "time")
        self.assertEqual(od("1", "60FF", "0x1FFFFFFFF").returncode, 2)
        self.assertEqual(od("0", "1000").returncode, 2)

    def test_a_log_holds_what_was_on_the_bus(self):
        log = self.folder / "bus.log"
        recorder = subprocess.Popen([system.executable(), "can", "log", "--bus", self.bus, "-o", str(log), "--for", "5"],
                                    stderr=subprocess.DEVNULL, start_new_session=True)
        self.addCleanup(system.until, lambda: recorder.poll() is not None, 10, "the recorder ends")

        def seen():
            self.assert_ok(system.run("can", "od", "--bus", self.bus, "2", "1018:4"))
            recorder.send_signal(signal.SIGINT)
            return recorder.wait(10) == 0

        system.until(lambda: log.exists(), 5, "the log is there")
        self.assertTrue(seen())
        lines = log.read_text().splitlines()
        self.assertTrue(any(" 602#40181004" in line for line in lines), lines)
        self.assertTrue(any(" 582#4318100" in line for line in lines), lines)

    def test_budget_refuses_what_does_not_fit(self):
        good = json.loads(self.assert_ok(system.run("can", "budget", self.hardware, "--json")).stdout)
        self.assertEqual([bus["frames_per_cycle"] for bus in good], [19.0, 19.0])
        self.assertLess(good[0]["load"], 0.6)
        fast = self.folder / "fast.yaml"
        fast.write_text(self.hardware.read_text().replace("period_ms: 4", "period_ms: 2"))
        answer = system.run("can", "budget", fast)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("what would fit: a period of", answer.stdout)
        self.assertEqual(system.run("validate", fast).returncode, 2)


class Session(HalTest):
    def test_a_session(self):
        for bus in "ab":
            self.drive_sim(bus)
        running = self.start_hal()
        monitor = self.await_ready(running)
        self.assertEqual(len(monitor["axes"]), 12)
        self.assertEqual({axis["state"] for axis in monitor["axes"]}, {"switch on disabled"})
        self.assertEqual({axis["guards"] for axis in monitor["axes"]}, {"none"})
        self.assertEqual({axis["temperature"] for axis in monitor["axes"]} - {None}, {25.0})
        self.assertIn("nothing to do", self.assert_ok(system.run("home", "-d", running.path)).stdout)
        self.assert_refused(system.run("can", "scan", "--bus", f"unix:{self.socket('a')}"), "master")

        home = running.joints()
        self.assert_ok(running.robot("enable"))
        self.assertEqual(system.run("jog", "-d", running.path, "a", "beta_9", "1").returncode, 2)
        self.assert_ok(system.run("jog", "-d", running.path, "a", "beta_1", "2", "--for", "1"))
        moved = [now - before for now, before in zip(running.joints()[0], home[0])]
        self.assertGreater(moved[0], 1e-3)
        self.assertLess(moved[0], 4e-3)
        self.assertLess(max(map(abs, moved[1:])), 1e-6)
        self.assert_ok(running.robot("move-jp", "--arm", "a", "--", *home[0]))

        self.tell("a", "inject 2 over_current")
        system.until(lambda: running.states()[0] == "FAULT", 5, "arm_a is in FAULT")
        monitor = self.monitor(running)
        self.assertIn("over-current (0x2310)", [axis["last_error"] for axis in monitor["axes"]][1])
        self.assertGreaterEqual(monitor["guards"]["emergency"] + monitor["guards"]["drive_fault"], 1)
        self.assert_refused(running.robot("enable"), "FAULT")
        self.tell("a", "clear 2")
        self.assert_ok(running.robot("disable"))
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])
        self.await_ready(running)
        self.assert_ok(running.robot("enable"))
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 3, 0], points=4)))
        self.assertEqual({drive["limit_hits"] for bus in "ab" for drive in self.drives(bus)}, {0})


class Death(HalTest):
    def test_drives_stop_by_themselves_when_the_hal_is_killed(self):
        for bus in "ab":
            self.drive_sim(bus)
        running = self.start_hal()
        self.await_ready(running)
        client = self.start_run(running, self.long_line())
        running.await_motion(client)
        os.kill(running.pids["hal"], signal.SIGKILL)
        running.event("died", 10)

        def standing():
            return all(drive["state"] != "operation enabled" and abs(drive["velocity"]) < 1 for bus in "ab"
                       for drive in self.drives(bus))

        system.until(standing, 5, "all drives stand, without torque")
        positions = [drive["position"] for drive in self.drives("a")]
        self.assertEqual(positions, [drive["position"] for drive in self.drives("a")])
        running.event("stopped", 20)


class Table3(HalTest):
    def test_a_run_of_table_3_converges_at_every_point(self):
        path = system.deployment(self.folder, "drives", hardware=self.hardware, budgets=BUDGETS)
        path.write_text(path.read_text().replace("[--hardware, ark2024-two-buses,", f"[--hardware, {self.hardware},"))
        answer = system.run("experiment", "table3", "-d", path, "--only", "rectangle-2-nspqp", "--json", timeout=350)
        self.assert_ok(answer)
        row = json.loads(answer.stdout)["rows"][0]
        self.assertEqual((row["converged"], row["points"], row["limit_violations"]), (100, 100, 0))
        self.assertLess(row["epsilon_ab"]["max_mm"], 0.88)
        self.assertLess(row["epsilon_a"]["max_mm"], 0.88)


if __name__ == "__main__":
    system.main()
