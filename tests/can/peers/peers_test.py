# SPDX-License-Identifier: Apache-2.0
"""Others on the wire: npm's canopen as master and as slave, cansend and candump, tshark. On vcan0; see run.sh.

    peers_test.py EXECUTABLES TEST_EXECUTABLES [TEST...]
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import dissection  # noqa: E402

BIN, TESTS = (pathlib.Path(sys.argv.pop(1)) for _ in range(2)) if __name__ == "__main__" else (None, None)
EDS = HERE.parents[2] / "sim" / "drives" / "eds"
SHEETS = HERE.parents[2] / "tests" / "sheets"
PRESETS = HERE.parents[2] / "config" / "presets"
INTERFACE = "vcan0"


def until(condition, seconds, what):
    end = time.monotonic() + seconds
    while not (result := condition()):
        if time.monotonic() > end:
            raise AssertionError(f"waited {seconds} s in vain: {what}")
        time.sleep(0.02)
    return result


class PeersTest(unittest.TestCase):
    """Records everything on the bus, and dissects it at the end."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.log = self.folder / "bus.log"
        with self.log.open("w") as file:
            self.recorder = self.start(["candump", "-L", INTERFACE], stdout=file)
        self.wait_for_recorder()

    def wait_for_recorder(self):
        """candump does not report its start: frames without effect are sent until one is received."""
        def received():
            subprocess.run(["cansend", INTERFACE, "77E#05"], check=True)
            return self.log.stat().st_size > 0
        until(received, 20, "candump listens")

    def start(self, command, **streams):
        process = subprocess.Popen(list(map(str, command)), **streams)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def start_ready(self, command, word):
        """Starts a process and waits for a word in its output."""
        output = self.folder / f"{pathlib.Path(command[0]).name}.out"
        with output.open("w") as file:
            process = self.start(command, stdout=file, stderr=subprocess.STDOUT)

        def said():
            self.assertIsNone(process.poll(), output.read_text())
            return word in output.read_text()
        until(said, 60, f"{command[0]} is ready")
        return process

    def drive_sim(self):
        return self.start_ready([BIN / "tandem-drive-sim", "--bus", f"can:{INTERFACE}", "--drive", "1,serial=4711",
                                 "--encoder", "17=1", "--log", "info"], "ready")

    def assert_dissected(self, *wanted):
        """Wireshark dissects every frame as CANopen, and these kinds are among them."""
        self.recorder.send_signal(signal.SIGINT)
        self.recorder.wait(10)
        kinds, complaints = dissection.dissect(self.log)
        print(f"{self.id()}: {sum(kinds.values())} frames dissected, {len(complaints)} complaints: {dict(kinds)}")
        self.assertEqual(complaints, [])
        for kind in wanted:
            self.assertTrue(any(kind in name for name in kinds), f"no {kind} in {list(kinds)}")


class Master(PeersTest):
    def test_an_independent_master_leads_a_simulated_drive(self):
        self.drive_sim()
        answer = subprocess.run(["node", HERE / "master.js", INTERFACE, "1", "4711"], capture_output=True, text=True,
                                timeout=200, check=False)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        print(answer.stdout.strip())
        self.assert_dissected("PDO1 (tx)", "PDO1 (rx)", "Boot-up", "Stopped", "Abort", "Upload segment")


class Slave(PeersTest):
    def lead(self, sheet, hardware=PRESETS / "hardware" / "ark2024-two-buses.yaml"):
        """The HAL boots, enables and moves a drive that npm's canopen makes of this data sheet."""
        slave = self.start_ready(["node", HERE / "slave.js", INTERFACE, sheet, "1", EDS / "tandem-encoder.eds", "17"], "ready")
        answer = subprocess.run([TESTS / "test_can_foreign_drive"], capture_output=True, text=True, timeout=200, check=False,
                                env={**os.environ, "TANDEM_HARDWARE": str(hardware)})
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        self.assertIsNone(slave.poll())
        slave.kill()
        slave.wait()  # the next one has the same node id

    def test_the_hal_leads_an_independent_drive(self):
        self.lead(EDS / "tandem-drive.eds")
        self.assert_dissected("PDO1 (tx)", "PDO1 (rx)", "PDO2 (tx)", "Boot-up", "Operational", "SYNC")

    def test_the_hal_leads_independent_drives_with_data_sheets_of_vendors(self):
        preset = (PRESETS / "hardware" / "ark2024-two-buses.yaml").read_text().replace("../robots", str(PRESETS / "robots"))
        preset = preset.replace('      temperature_object: "2001:00"\n', "")
        for profile in ("epos4", "gold", "mc3"):  # those with cyclic synchronous position
            hardware = self.folder / f"{profile}.yaml"
            hardware.write_text(preset.replace("  - drive:\n", f"  - drive:\n      profile: {profile}\n", 1))
            self.lead(SHEETS / f"{profile}-like.eds", hardware)
        self.assert_dissected("PDO1 (tx)", "PDO1 (rx)", "Boot-up", "Operational", "SYNC")


class CanUtils(PeersTest):
    """Hand-made frames, byte by byte."""

    def received(self):
        return re.findall(r" (\w+#\w*)", self.log.read_text())

    def exchange(self, sent, answer, seconds=20):
        """Sends a frame and waits for this answer (a regular expression)."""
        before = len(self.received())
        subprocess.run(["cansend", INTERFACE, sent], check=True)

        def answered():
            return next((frame for frame in self.received()[before:] if re.fullmatch(answer, frame)), None)
        return until(answered, seconds, f"{sent} is answered by {answer}; received {self.received()[before:]}")

    def test_cansend_and_candump_see_a_canopen_node(self):
        drive = self.drive_sim()
        until(lambda: "701#00" in self.received(), 20, "it boots")  # first, since a second boot-up is that of the reset
        self.exchange("000#8201", "701#00")  # reset communication: boot-up
        self.exchange("601#4000100000000000", "581#4300100092010200")  # device type
        self.exchange("601#4018100400000000", "581#4318100467120000")  # serial number 4711
        self.exchange("601#4041600000000000", "581#4B416000....0000")  # two bytes
        self.exchange("601#2F60600008000000", "581#6060600000000000")  # mode: CSP
        self.exchange("601#4061600000000000", "581#4F61600008000000")
        self.exchange("601#2B17101400000000", "581#8017101411000906")  # no such sub-index
        self.exchange("601#2317100000000000", "581#8017100012000706")  # too long
        self.exchange("601#2B17100014000000", "581#6017100000000000")  # heartbeat every 20 ms
        until(lambda: self.received().count("701#7F") > 3, 20, "heartbeats")
        self.exchange("601#40FF5F0000000000", "581#80FF5F0000000206")  # no such object
        self.exchange("601#4018100900000000", "581#8018100911000906")  # no such sub-index
        self.exchange("601#2B41600000000000", "581#8041600002000106")  # read-only
        self.exchange("601#E000000000000000", "581#80.{6}01000405")  # no such command
        # A segmented upload: toggles from 0, then a toggle that does not change.
        size = int(self.exchange("601#4008100000000000", "581#41081000..000000")[12:14], 16)
        self.assertGreater(size, 7)
        self.exchange("601#6000000000000000", "581#00.{14}")
        self.exchange("601#6000000000000000", "581#8008100000000305")
        self.exchange("000#0101", "701#05")  # operational
        before = len(self.received())
        self.exchange("080#", "281#5002.{8}")  # SYNC: by default statusword and position in the second TPDO
        subprocess.run(["cansend", INTERFACE, "000#0201"], check=True)
        until(lambda: "701#04" in self.received()[before:], 20, "the node says that it is stopped")
        before = len(self.received())
        subprocess.run(["cansend", INTERFACE, "601#4000100000000000"], check=True)
        until(lambda: self.received()[before:].count("701#04") > 3, 20, "heartbeats go on")
        self.assertFalse(any(frame.startswith("581") for frame in self.received()[before:]), "no SDO where stopped")
        self.exchange("000#8001", "701#7F")
        self.exchange("000#8101", "701#00")  # reset node
        # None of these may move or end anything.
        for noise in ("601#", "601#40", "000#01", "601#R", "00000601#4000100000000000", "201#0F",
                      "7FF#0102030405060708"):
            subprocess.run(["cansend", INTERFACE, noise], check=True)
        self.exchange("601#4000100000000000", "581#4300100092010200")
        self.assertIsNone(drive.poll())


if __name__ == "__main__":
    unittest.main(verbosity=2)
