# SPDX-License-Identifier: Apache-2.0
"""RTPS control messages forged without credentials: GAPs without an end, and noise.

Fast DDS 2.9.1 has no fix for them (docs/security.md), so an attacked process may end. It ends alone and early: the arms are at
standstill before it ends, and no other process ends with it."""
import os
import pathlib
import socket
import struct
import subprocess
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

LIMIT_MB = 1100  # of writable addresses: stacks and arenas of threads count before they are used
BUDGETS = {"budgets": "{minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 5000}", "sim_period_ms": 5,
           "control_period_s": 0.02}
DATA, GAP, HEARTBEAT, ACKNACK, DATA_FRAG, NACK_FRAG, INFO_TS, INFO_SRC, INFO_DST = 0x15, 8, 7, 6, 0x16, 0x12, 9, 0xc, 0xe


def udp_ports(pid):
    """UDP ports that a process has open."""
    inodes = set()
    for entry in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        try:
            link = os.readlink(entry)
        except OSError:
            continue  # closed meanwhile
        if link.startswith("socket:["):
            inodes.add(link[8:-1])
    lines = pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]
    return sorted({int(words[1].split(":")[1], 16) for words in map(str.split, lines) if words[9] in inodes})


def message(prefix, *submessages):
    return b"RTPS\x02\x03\x01\x0f" + prefix + b"".join(submessages)


def submessage(kind, body, flags=1, length=None):
    return struct.pack("<BBH", kind, flags, len(body) if length is None else length) + body


def endless_gap(writer):
    """GAP from 1000 to 2^62, to all readers of this writer."""
    return submessage(GAP, bytes(4) + writer + struct.pack("<iIiII", 0, 1000, 1 << 30, 0, 0))


class Memory(threading.Thread):
    """Maximum memory of a process during its life, MB."""

    def __init__(self, pid):
        super().__init__(daemon=True)
        self.most, self._pid, self._end = 0.0, pid, threading.Event()
        self.start()

    def run(self):
        while not self._end.wait(0.02):
            try:
                words = pathlib.Path(f"/proc/{self._pid}/status").read_text()
            except OSError:
                return
            for line in words.splitlines():
                if line.startswith("VmHWM"):
                    self.most = max(self.most, float(line.split()[1]) / 1024)

    def end(self):
        self._end.set()
        self.join(10)
        return self.most


class Floods(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.domain, self.prefix = system.free_domain(), f"t{os.getpid()}"
        self.log = self.folder / "log"
        system.System.stderr = self.log.open("w")
        self.addCleanup(setattr, system.System, "stderr", None)
        self.addCleanup(system.System.stderr.close)
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.sender.close)

    def moving(self):
        running = self.start("laptop", domain=self.domain, prefix=self.prefix, memory_limit_mb=LIMIT_MB, **BUDGETS)
        self.assert_ok(running.robot("enable"))
        client = self.start_run(running, self.long_line())
        running.await_motion(client)
        running.parts = ("state", "status")  # planning may stop publishing
        return running

    def hit(self, running, pid, text):
        """Sends the text repeatedly to all ports of a process, which ignores it until it has discovered the sender, until a process
        dies."""
        ports = udp_ports(pid)
        ending = threading.Event()

        def send():
            while not ending.wait(0.1):
                for port in ports:
                    self.sender.sendto(text, ("127.0.0.1", port))

        thread = threading.Thread(target=send, daemon=True)
        thread.start()
        try:
            return running.event("died", 60)
        finally:
            ending.set()
            thread.join()

    def peer(self, topic, readers):
        program = pathlib.Path(system.executable()).parents[1] / "tests" / "gap_peer"
        process = subprocess.Popen([program, str(self.domain), self.prefix, topic, str(readers)], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.stdin.close)
        prefix, writer = process.stdout.readline().split()
        return bytes.fromhex(prefix), bytes.fromhex(writer)

    def test_one_gap_without_an_end(self):
        running = self.moving()
        control = running.pids["control"]
        memory = Memory(control)
        prefix, writer = self.peer("control/request", 1)
        died = self.hit(running, control, message(prefix, endless_gap(writer)))
        most = memory.end()
        print(f"{died}; it took {most:.0f} MB", flush=True)
        self.assertEqual(died["process"], "control")
        self.assertLess(most, LIMIT_MB)
        running.event("stopped", 30)
        self.assertEqual(running.up.wait(30), 1)
        others = [event["process"] for event in running.events if event["event"] == "died"]
        self.assertEqual(others, ["control"], "somebody else was ended with it")
        log = self.log.read_text()
        print(log, flush=True)
        # While control received nothing, it stopped the arms, long before it died.
        self.assertRegex(log, r"\[control\].* FAULT of arm_a: state_timeout[^\n]*\n(.*\n)*.*\[sim\].* stop: tandem up: control")
        self.assertIn(f"tandem up: control (pid {control}) was killed by signal 6", system.black_box(self.folder / "black-box"))

    def test_noise(self):
        """All submessages of RTPS, with invalid fields."""
        running = self.moving()
        noise = system.seeded(self)
        prefix, writer = self.peer("planning/request", 1)
        ports = {port: name for name, pid in running.pids.items() for port in udp_ports(pid)}
        for _ in range(3000):
            parts = [self.nonsense(noise, writer) for _ in range(noise.randint(1, 4))]
            text = bytearray(message(prefix if noise.random() < 0.7 else noise.randbytes(12), *parts))
            for _ in range(noise.choice([0, 0, 1, 5])):
                text[noise.randrange(len(text))] = noise.randrange(256)
            self.sender.sendto(text[:noise.randrange(8, 65000)], ("127.0.0.1", noise.choice(list(ports))))
        if not self.died(running):
            # All processes run, though some may receive nothing: either the client is received, or the arms are in FAULT.
            if running.robot("disable").returncode != 0:
                system.until(lambda: running.states() == ["FAULT"] * 2, 20, "the arms stop")
            running.assert_still(self, looks=3)
            return
        running.event("stopped", 30)
        self.assertEqual(len([event for event in running.events if event["event"] == "died"]), 1, "one alone")

    @staticmethod
    def died(running):
        try:
            print(running.event("died", 3), flush=True)
            return True
        except AssertionError:
            return False

    @staticmethod
    def nonsense(noise, writer):
        kind = noise.choice([DATA, GAP, HEARTBEAT, ACKNACK, DATA_FRAG, NACK_FRAG, INFO_TS, INFO_SRC, INFO_DST,
                             noise.randrange(256)])
        number = struct.pack("<iI", noise.choice([0, 0, -1, 1 << 30]), noise.choice([0, 1, 77, (1 << 32) - 1]))
        ids = bytes(4) + (writer if noise.random() < 0.7 else noise.randbytes(4))
        body = {DATA: struct.pack("<HH", 0, noise.choice([16, 0, 65535])) + ids + number + noise.randbytes(40),
                HEARTBEAT: ids + number + number + noise.randbytes(4),
                DATA_FRAG: struct.pack("<HH", 0, 28) + ids + number
                + struct.pack("<IHHI", noise.choice([0, 1, 1 << 31]), noise.choice([0, 1, 65535]), noise.choice([0, 1024, 65535]),
                              noise.choice([0, 100, (1 << 32) - 1])) + noise.randbytes(64),
                # A GAP of a few hundred numbers: the one without an end has a separate test.
                GAP: ids + struct.pack("<iIiII", 0, 5, 0, noise.randrange(600), noise.choice([0, 256, (1 << 32) - 1]))
                + noise.randbytes(32)}.get(kind, ids + number + noise.randbytes(noise.randrange(64)))
        return submessage(kind, body, noise.randrange(256) if noise.random() < 0.3 else 1,
                          noise.choice([None, None, None, 0, 3, 65535]))


if __name__ == "__main__":
    system.main()
