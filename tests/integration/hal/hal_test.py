# SPDX-License-Identifier: Apache-2.0
"""tandem-hal with two buses of simulated drives, controlled by the command line; and `tandem can` on such a bus."""
import json
import os
import pathlib
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import HalTest, system  # noqa: E402


class Can(HalTest):
    """`tandem can` without a master."""

    def setUp(self):
        super().setUp()
        self.address = self.bus("a")
        self.drive_sim("a")

    def test_scan_lists_the_nodes_of_the_bus(self):
        found = json.loads(self.assert_ok(system.run("can", "scan", "--bus", self.address, "--json")).stdout)
        self.assertEqual([node["node"] for node in found], [1, 2, 3, 4, 5, 6, 17, 18, 19, 20, 21, 22])
        self.assertEqual([node["profile"] for node in found], 6 * [402] + 6 * [406])
        self.assertEqual([node["serial"] for node in found], [1000 + node["node"] for node in found])
        self.assertEqual({node["drive_state"] for node in found[:6]}, {"switch on disabled"})
        self.assertIn("402 drive", self.assert_ok(system.run("can", "scan", "--bus", self.address)).stdout)

    def test_objects_are_read_and_written(self):
        def od(*words):
            return system.run("can", "od", "--bus", self.address, "--json", *words)

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
        recorder = subprocess.Popen([system.executable(), "can", "log", "--bus", self.address, "-o", str(log), "--for",
                                     "5"], stderr=subprocess.DEVNULL, start_new_session=True)
        self.addCleanup(system.until, lambda: recorder.poll() is not None, 10, "the recorder ends")

        def seen():
            self.assert_ok(system.run("can", "od", "--bus", self.address, "2", "1018:4"))
            recorder.send_signal(signal.SIGINT)
            return recorder.wait(10) == 0

        system.until(lambda: log.exists(), 5, "the log is there")
        self.assertTrue(seen())
        lines = log.read_text().splitlines()
        self.assertTrue(any(" 602#40181004" in line for line in lines), lines)
        self.assertTrue(any(" 582#4318100" in line for line in lines), lines)

    def test_budget_refuses_what_does_not_fit(self):
        good = json.loads(self.assert_ok(system.run("can", "budget", self.hardware, "--json")).stdout)
        self.assertEqual([bus["frames_per_cycle"] for bus in good], [20.0, 20.0])
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
        sheet = system.SOURCE / "sim" / "drives" / "eds" / "tandem-drive.eds"
        for words in (("scan",), ("dump", "1"), ("compare", sheet, "1"), ("od", "1", "--protections")):
            self.assert_refused(system.run("can", *words, "--bus", self.bus("a")), "master")

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


class RefusedBoot(HalTest):
    def test_the_monitor_says_why_a_node_is_not_operational(self):
        for bus in "ab":
            self.drive_sim(bus)
        text = self.hardware.read_text().replace("bus: bus_a, node: 2,", "bus: bus_a, node: 2, serial: 4711,")
        self.hardware.write_text(text)
        running = self.start_hal()
        reason = "arm_a translation 2 (node 2): serial number 1018:04: found 1002 (0x3EA), expected 4711 (0x1267)"

        system.until(lambda: self.monitor(running)["failed"] == {"tandem-hal": {"arm_a translation 2": reason}}, 60,
                     "the monitor has the reason")
        axes = self.monitor(running)["axes"]
        self.assertEqual([k for k, axis in enumerate(axes) if not axis["operational"]], [1])
        self.assertEqual(axes[1]["last_error"], "not operational: its boot was refused, or it was lost")
        self.assertIn("arm_a translation 2 failed: " + reason, self.assert_ok(system.run("can", "monitor", running.path, "--once")).stdout)


class Withdrawal(HalTest):
    def test_an_arm_with_a_dead_drive_comes_back(self):
        for bus in "ab":
            self.drive_sim(bus)
        running = self.start_hal()
        self.await_ready(running)
        self.assert_refused(running.robot("withdraw", "a"), "recover it first")
        self.assert_ok(running.robot("enable"))
        self.tell("a", "inject 2 off")
        system.until(lambda: running.states()[0] == "FAULT", 5, "arm_a is in FAULT")
        self.assert_refused(running.robot("enable"), "FAULT")
        start = running.joints()

        answer = self.assert_ok(running.robot("recover", "a", "--without", "alpha_3"))
        self.assertIn("recovered without beta_2, alpha_3", answer.stdout)
        self.assertIn("being recovered without beta_2, alpha_3",
                      self.assert_ok(system.run("status", "-d", running.path)).stdout)
        self.assertEqual(running.joints()[0], start[0], "power alone moves nothing")
        self.assert_refused(running.robot("home"), "only jog and withdraw")
        self.assert_ok(system.run("jog", "-d", running.path, "a", "beta_3", "--for", "1", "--", "-5"))
        way = [now - before for now, before in zip(running.joints()[0], start[0])]
        self.assertLess(way[2], -0.5e-3)
        self.assertGreater(way[2], -3e-3, "not faster than 2 mm/s")
        self.assertEqual([way[1], way[5]], [0.0, 0.0])

        client = system.client(running.path, "withdraw", "a")
        self.addCleanup(system.reap, client)
        system.until(lambda: running.joints()[0][0] < start[0][0] - 2e-3, 15, "the innermost tube goes back")
        client.send_signal(signal.SIGINT)
        self.assertEqual(client.wait(10), 1)
        self.assertIn("the arm stands", client.stderr.read())
        system.until(lambda: running.joints() == running.joints(), 5, "the arm stands")
        held = running.joints()[0]
        self.assertEqual(running.states()[0], "ENABLED")
        self.assertLess(max(abs(a - b) for a, b in zip(running.joints()[0], held)), 1e-5, "it holds")
        self.assert_ok(running.robot("stop"))
        system.until(lambda: running.states()[0] == "FAULT", 5, "arm_a is in FAULT")
        stood = running.joints()[0]
        self.assert_ok(running.robot("recover", "a"))
        self.assert_ok(running.robot("disable"))
        self.assertEqual(running.joints()[0], stood)
        self.assertEqual({drive["limit_hits"] for bus in "ab" for drive in self.drives(bus)}, {0})


class Up(HalTest):
    def test_a_deployment_starts_its_drives_and_moves(self):
        running = self.start_hal(with_drives=True)
        self.assertEqual(set(running.pids), {"drives-a", "drives-b", "hal", "control", "planning", "recorder"})
        self.await_ready(running)
        start = running.joints()
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 3, 0], points=4)))
        self.assertNotEqual(running.joints(), start)
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])


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


if __name__ == "__main__":
    system.main()
