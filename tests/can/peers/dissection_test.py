# SPDX-License-Identifier: Apache-2.0
"""Two buses of simulated drives with tandem-hal, recorded from before the boot to after the end: Wireshark dissects every frame as
CANopen."""
import pathlib
import signal
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "integration" / "hal")]
import dissection  # noqa: E402
from hardware import HalTest, system  # noqa: E402


class Dissection(HalTest):
    def test_invalid_frames_are_reported(self):
        log = self.folder / "bad.log"
        for bad in ("601#4018", "000#01", "00000601#4000100000000000"):
            log.write_text(f"(1.000000) a 601#4000100000000000\n(2.000000) a {bad}\n")
            kinds, complaints = dissection.dissect(log)
            self.assertEqual((sum(kinds.values()), len(complaints)), (2, 1), f"{bad}: {complaints}")

    def record(self, bus):
        log = self.folder / f"bus-{bus}.log"
        process = subprocess.Popen([system.executable(), "can", "log", "--bus", self.bus(bus), "-o", str(log)],
                                   stderr=subprocess.DEVNULL, start_new_session=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        system.until(log.exists, 10, "the recorder is on the bus")  # it joins the bus before it opens the file
        return process, log

    def test_every_frame_of_a_run_is_canopen(self):
        for bus in "ab":
            self.drive_sim(bus)
        recorders = [self.record(bus) for bus in "ab"]
        running = self.start_hal()
        self.await_ready(running)
        self.assert_ok(running.robot("enable"))
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 3, 0], points=4)))
        self.assert_ok(running.robot("enable"))  # a run ends in DISABLED
        self.tell("a", "inject 2 over_current")  # an emergency message
        system.until(lambda: running.states()[0] == "FAULT", 10, "arm_a is in FAULT")
        self.tell("a", "clear 2")
        self.assert_ok(running.robot("disable"))
        self.await_ready(running)
        running.close()
        for process, log in recorders:
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(20), 0)
            kinds, complaints = dissection.dissect(log)
            print(f"{log.name}: {sum(kinds.values())} frames, {len(complaints)} complaints: {dict(kinds)}")
            self.assertEqual(complaints[:10], [])
            for kind in ("Boot-up", "Reset communication", "Start remote node", "SYNC", "PDO1 (rx)", "PDO1 (tx)",
                         "PDO2 (tx)", "download request", "upload response"):
                self.assertTrue(any(kind in name for name in kinds), f"no {kind} in {list(kinds)}")
        self.assertTrue(any("EMCY" in name for name in dissection.dissect(recorders[0][1])[0]))


if __name__ == "__main__":
    system.main()
