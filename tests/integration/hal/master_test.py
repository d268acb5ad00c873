# SPDX-License-Identifier: Apache-2.0
"""Two masters on one bus: real processes, and a third node that sends frames of a master."""
import pathlib
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import HalTest, system  # noqa: E402

NMT, SYNC, COMMAND, SDO_REQUEST, HEARTBEAT = 0x000, 0x080, 0x200, 0x600, 0x77F
OCCUPIED = 3  # exit code


class Master(threading.Thread):
    """Sends SYNC every 10 ms, and receives all other frames."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.received, self._port, self._ending = set(), port, threading.Event()

    def run(self):
        while not self._ending.is_set():
            self._port.send(SYNC)
            identifier = self._port.receive(0.01)
            if identifier is not None:
                self.received.add(identifier)

    def end(self):
        self._ending.set()
        self.join()


class OtherMaster(HalTest):
    def setUp(self):
        super().setUp()
        for bus in "ab":
            self.drive_sim(bus)

    def second_hal(self, path):
        return system.run("--deployment", path, "--log", "info", program="tandem-hal", timeout=60)

    def assert_undisturbed(self):
        for bus in "ab":
            for drive in self.drives(bus):
                self.assertEqual((drive["state"], drive["faults"]), ("operation enabled", 0), drive)

    def test_a_second_hal_on_this_host_refuses_and_the_first_goes_on(self):
        running = self.start_hal()
        self.await_ready(running)
        client = self.start_run(running, self.long_line())
        running.await_motion(client)
        before = running.joints()
        answer = self.second_hal(running.path)
        self.assertEqual(answer.returncode, OCCUPIED, answer.stdout + answer.stderr)
        for words in (f"bus bus_a ({self.bus('a')})", f"process {running.pids['hal']} (tandem-hal)", "stop it first"):
            self.assertIn(words, answer.stdout + answer.stderr)
        self.assert_undisturbed()
        self.assertEqual(running.states(), ["ENABLED", "ENABLED"])
        system.until(lambda: running.joints() != before, 5, "the arms go on")
        self.assertIsNone(client.poll())
        self.assert_undisturbed()

    def test_a_hal_that_receives_frames_of_a_master_sends_none(self):
        master = Master(self.port("b"))
        master.start()
        answer = self.second_hal(self.deployment())
        master.end()
        self.assertEqual(answer.returncode, OCCUPIED, answer.stdout + answer.stderr)
        for words in (f"bus bus_b ({self.bus('b')})", "received SYNC (", "stop the other tandem-hal"):
            self.assertIn(words, answer.stdout + answer.stderr)
        of_a_hal = {NMT, HEARTBEAT} | {base + node for base in (COMMAND, SDO_REQUEST) for node in range(1, 23)}
        self.assertEqual(master.received & of_a_hal, set(), "it has spoken")
        # Without the other master it starts.
        running = self.start_hal()
        self.await_ready(running)

    def test_a_foreign_frame_stops_the_arms_of_its_bus(self):
        running = self.start_hal()
        self.await_ready(running)
        client = self.start_run(running, self.long_line())
        running.await_motion(client)
        port = self.port("a")
        port.send(SYNC)
        system.until(lambda: running.states()[0] == "FAULT", 5, "arm_a is in FAULT")
        self.assertIn("another master on the bus", running.status()["arms"][0]["drive_fault"])
        self.assertEqual(self.monitor(running)["guards"]["foreign_master"], 6)
        system.until(lambda: all(drive["state"] != "operation enabled" and abs(drive["velocity"]) < 1
                                 for drive in self.drives("a")), 5, "arm_a stands, without torque")
        client.wait(30)
        # After as long without its frames as a HAL listens at start, the other master counts as gone: `disable` clears the fault.
        system.until(lambda: running.robot("disable").returncode == 0, 20, "the fault is cleared")
        self.await_ready(running)
        self.assert_ok(running.robot("enable"))
        self.assertEqual(running.states(), ["ENABLED", "ENABLED"])


if __name__ == "__main__":
    system.main()
