# SPDX-License-Identifier: Apache-2.0
"""Two buses of simulated drives with tandem-hal, for tests.

The buses are sockets, or the CAN interfaces in TANDEM_CAN ("vcan0,vcan1")."""
import json
import math
import os
import pathlib
import socket
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

# User-mode Linux has one slow processor, which pauses while its host is busy.
SLOW = bool(os.environ.get("TANDEM_CAN"))
BUDGETS = ("{minimum_age_ms: 1500, planning_reference_ms: 3000, lease_ms: 6000, drive_heartbeat_ms: 3000}" if SLOW
           else "{drive_heartbeat_ms: 100}")
PRIORITY = 0 if SLOW else system.priority()
# Counts per m and per rad of the preset's drives.
COUNTS_PER_M = 4096 * 10 / 2e-3
COUNTS_PER_RAD = 4096 * 100 / (2 * math.pi)
# Velocity limits of the hardware file: m/s, rad/s.
VELOCITY = [0.01] * 3 + [2.0] * 3


def favour(process):
    """Gives the simulated drives priority over compilers, if this user may set priorities."""
    try:
        os.setpriority(os.PRIO_PROCESS, process.pid, -15)
        # Autogroups (sessions) share the processor before processes do.
        pathlib.Path(f"/proc/{process.pid}/autogroup").write_text("-15")
    except OSError:
        pass
    return process


class Port:
    """A participant of a bus for tests: raw frames, on a socket or a CAN interface."""

    _FRAME = struct.Struct("=IB3x8s")

    def __init__(self, address):
        kind, _, place = address.partition(":")
        if kind == "can":
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            self._socket.bind((place,))
        else:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            self._socket.connect(place)

    def send(self, identifier, data=b""):
        self._socket.send(self._FRAME.pack(identifier, len(data), data))

    def receive(self, seconds):
        """The identifier of the next frame; None if none is received within that time."""
        self._socket.settimeout(seconds)
        try:
            return self._FRAME.unpack(self._socket.recv(self._FRAME.size))[0]
        except (TimeoutError, BlockingIOError):
            return None

    def close(self):
        self._socket.close()


class HalTest(system.SystemTest):
    """Separate hardware and deployment; drives started by the test or by the deployment."""

    budgets = BUDGETS
    feedback_budget_ms = 900 if SLOW else 30

    def setUp(self):
        super().setUp()
        preset = (system.PRESETS / "hardware" / "ark2024-two-buses.yaml").read_text()
        for bus in "ab":
            preset = preset.replace(f"unix:/tmp/tandem-bus-{bus}", self.bus(bus))
        preset = preset.replace("../robots/ark2024.yaml", str(system.PRESETS / "robots" / "ark2024.yaml"))
        self.hardware = self.folder / "hardware.yaml"
        preset = preset.replace("feedback_budget_ms: 300", f"feedback_budget_ms: {self.feedback_budget_ms}")
        if os.environ.get("TANDEM_CAN"):  # a virtual machine with one slow CPU cannot run 250 cycles per second
            preset = preset.replace("period_ms: 4", "period_ms: 10")
            # Drives that the guest's scheduler delays by 0.3 s lag by 3 mm.
            preset = preset.replace("following_error_mm: 1", "following_error_mm: 4")
            preset = preset.replace("following_error_deg: 5", "following_error_deg: 45")
            preset = preset.replace("first_motion_mm: 1", "first_motion_mm: 4").replace("first_motion_deg: 5", "first_motion_deg: 45")
        self.hardware.write_text(preset)

    def bus(self, name):
        """Address of bus a or b."""
        interfaces = os.environ.get("TANDEM_CAN", "")
        return f"can:{interfaces.split(',')['ab'.index(name)]}" if interfaces else f"unix:{self.folder / f'bus-{name}'}"

    def control(self, bus):
        return self.folder / f"control-{bus}"

    def drive_sim(self, bus, *more):
        """Simulated drives of one bus, started by the test; returns when their control socket answers."""
        process = favour(subprocess.Popen([system.executable("tandem-drive-sim"), "--hardware", str(self.hardware),
                                           "--hardware-bus", f"bus_{bus}", "--control", str(self.control(bus)), "--log",
                                           "warn", *more], start_new_session=True))
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

        def answers():
            try:
                return self.tell(bus, "state")
            except OSError:
                return None

        system.until(answers, 20, "the drives answer")
        return process

    def port(self, bus):
        port = Port(self.bus(bus))
        self.addCleanup(port.close)
        return port

    def tell(self, bus, line):
        """Sends a line to the simulated drives and returns their answer."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
            connection.settimeout(10)
            connection.connect(str(self.control(bus)))
            connection.send(line.encode())
            answer = connection.recv(1 << 16).decode()
        self.assertFalse(answer.startswith("error"), answer)
        return answer

    def drives(self, bus):
        return json.loads(self.tell(bus, "state"))["drives"]

    def deployment(self, with_drives=False, **changes):
        """Deployment file with this hardware; with all processes of the preset, or without the drives, which the test starts, and the
        recorder, which a virtual machine with one CPU cannot run in addition."""
        path = system.deployment(self.folder, "drives", hardware=self.hardware,
                                 **{"budgets": self.budgets, "realtime_priority": PRIORITY, **changes})
        text = path.read_text().replace("[--hardware, ark2024-two-buses,", f"[--hardware, {self.hardware},")
        if not with_drives:
            kept, skipping = [], False
            for line in text.splitlines():
                if line.startswith("  - "):
                    skipping = "drives-" in line or "recorder" in line
                elif not line.startswith("   "):
                    skipping = False
                if not skipping:
                    kept.append(line)
            text = "\n".join(kept) + "\n"
        path.write_text(text)
        return path

    def start_hal(self, with_drives=False, **changes):
        started = system.System(self.deployment(with_drives, **changes))
        self.addCleanup(started.close)
        favour(started.up)
        return started

    def monitor(self, running):
        answer = self.assert_ok(system.run("can", "monitor", running.path, "--once", "--json"))
        return json.loads(answer.stdout)

    def await_ready(self, running):
        return system.until(lambda: (lambda m: all(arm["homed"] for arm in m["arms"]) and m)(self.monitor(running)),
                            30, "all axes know where they are")

    def assert_limits_kept(self):
        """Counters of the drives: no target outside their limits, no joint faster than the hardware file allows.

        A HAL that is one cycle late on an ordinary scheduler sends two targets in one interval, which a drive follows with twice the
        speed, up to its maximum motor speed (6080: the double of the file's). In a virtual machine with one slow CPU that happens often
        enough to reach it."""
        haste = 2.01 if os.environ.get("TANDEM_CAN") else 1.5
        for bus in "ab":
            for drive, velocity in zip(self.drives(bus), VELOCITY):
                scale = COUNTS_PER_M if drive["id"] <= 3 else COUNTS_PER_RAD
                self.assertEqual((drive["limit_hits"], drive["faults"]), (0, 0), drive)
                self.assertLessEqual(drive["peak_velocity"] / scale, haste * velocity, drive)
