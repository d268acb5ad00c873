# SPDX-License-Identifier: Apache-2.0
"""A secured system with hostile processes on its network: they receive nothing and move nothing.

`hostile_peer` (in this folder) tries everything; with the credentials of an operator it succeeds, which shows that the attempts are
effective."""
import json
import os
import pathlib
import selectors
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from credentials import Authority, day, system  # noqa: E402

# For a loaded machine.
LONG_BUDGETS = {"budgets": "{minimum_age_ms: 3000, planning_reference_ms: 5000, lease_ms: 9000}", "sim_period_ms": 5}
ATTACK = 4.0  # s: handshakes whose first message is lost are repeated every second


class Hostile:
    """A running hostile_peer."""

    def __init__(self, domain, prefix, *words):
        peer = pathlib.Path(system.executable()).parents[1] / "tests" / "hostile_peer"
        self._process = subprocess.Popen([peer, str(domain), prefix, *map(str, words)], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.started = self._process.stdout.readline()

    def kill(self):
        """For clean-ups, in any state."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            stream.close()

    def end(self):
        """Its result."""
        output, errors = self._process.communicate(timeout=60)
        if self._process.returncode != 0 or not self.started:
            raise AssertionError(f"hostile_peer ended with {self._process.returncode}: {errors}")
        return json.loads(output)


class Listener(threading.Thread):
    """Receives all UDP datagrams on the loopback interface to the ports of a DDS domain."""

    def __init__(self, domain):
        super().__init__(daemon=True)
        self._ports = range(7400 + 250 * domain, 7650 + 250 * domain)
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        self._socket.bind(("lo", 0))
        self._ended = False
        self.datagrams = []
        self.start()

    def run(self):
        selector = selectors.DefaultSelector()
        selector.register(self._socket, selectors.EVENT_READ)
        while not self._ended:
            if not selector.select(0.1):
                continue
            frame, address = self._socket.recvfrom(65536)
            packet = frame[14:]
            if address[2] == socket.PACKET_OUTGOING or len(packet) < 28 or packet[9] != socket.IPPROTO_UDP:
                continue
            udp = packet[(packet[0] & 15) * 4:]
            port = struct.unpack_from("!H", udp, 2)[0]
            if port in self._ports:
                self.datagrams.append((port, udp[8:]))
        self._socket.close()

    def end(self):
        self._ended = True
        self.join(10)
        return self.datagrams


class Strangers(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.domain, self.prefix = system.free_domain(), f"t{os.getpid()}"
        self.authority = Authority(self.folder / "credentials", self.prefix, self.domain)
        self.authority.issue(**{"from": day(10)})

    def begin(self, **changes):
        return self.start("laptop", domain=self.domain, prefix=self.prefix, security=self.authority.folder, **{**LONG_BUDGETS, **changes})

    def hostile(self, *words, prefix=None):
        peer = Hostile(self.domain, prefix or self.prefix, *words)
        self.addCleanup(peer.kill)
        return peer

    def test_an_experiment_runs_secured(self):
        path = system.deployment(self.folder, "lockstep", domain=self.domain, prefix=self.prefix,
                                 security=self.authority.folder)
        answer = self.assert_ok(system.run("experiment", system.short_experiment(self.folder, "nspqp"), "--deployment", path,
                                           "--csv", self.folder / "csv", "--json", timeout=120))
        for row in json.loads(answer.stdout)["rows"]:
            self.assertEqual((row["converged"], row["limit_violations"]), (row["points"], 0))

    def test_strangers_get_nothing_and_move_nothing(self):
        issue = self.authority.issue
        expired = issue("console-operator", to=self.folder / "expired", **{"from": day(30), "days": 30})
        eve = issue("console-operator", name="eve", to=self.folder / "eve")
        elsewhere = issue("control", prefix="elsewhere", to=self.folder / "elsewhere")
        other = Authority(self.folder / "other", self.prefix, self.domain)
        other.issue("console-operator", **{"from": day(10)})
        self.authority.run("revoke", self.authority.folder, "eve")
        running = self.begin()
        self.assertTrue(running.status()["secured"])
        stood = running.joints()
        strangers = {
            "no certificate": self.hostile(),
            "an expired one": self.hostile("--credentials", expired, "console-operator", "--days-back", 1),
            "one of another authority": self.hostile("--credentials", other.folder, "console-operator"),
            "a revoked one": self.hostile("--credentials", eve, "console-operator"),
            "one for another robot": self.hostile("--credentials", elsewhere, "control", "--patched"),
        }
        viewers = {role: self.hostile("--credentials", self.authority.folder, role, "--patched")
                   for role in ("console-viewer", "recorder")}
        time.sleep(ATTACK)  # there is no event to wait for
        self.assertEqual(running.states(), ["DISABLED"] * 2)
        self.assertEqual(running.joints(), stood)
        self.assertEqual(running.status()["lease_owner"], 0)
        for name, stranger in strangers.items():
            got = stranger.end()
            print(f"{name}: {got}", flush=True)
            self.assertEqual(got["samples"], 0, f"{name}: {got}")
        for name, viewer in viewers.items():
            got = viewer.end()
            print(f"patched {name}: {got}", flush=True)
            self.assertGreater(got["checks_skipped"], 0, "the patch is not in force")
            self.assertGreater(got["samples"], 0, f"a {name} sees: {got}")
        # The same with an operator's credentials: it acquires the lease and switches power on.
        operator = self.hostile("--credentials", self.authority.folder, "console-operator")
        system.until(lambda: running.status()["lease_owner"] == 0xbadc0de, 30, "an operator gets the lease")
        self.assertGreater(operator.end()["samples"], 0)
        self.assertIsNone(running.up.poll(), "a process died")

    def test_a_viewer_sees_and_may_stop_and_cannot_command(self):
        running = self.begin()
        copy = self.folder / "credentials-of-a-viewer"
        shutil.copytree(self.authority.folder, copy, ignore=shutil.ignore_patterns("ca", "console-operator"))
        viewer = self.folder / "viewer.yaml"
        viewer.write_text(running.path.read_text().replace(str(self.authority.folder), str(copy)))
        self.assert_ok(running.robot("enable"))
        seen = self.assert_ok(system.run("status", viewer, "--json"))
        self.assertEqual(len(json.loads(seen.stdout)["arms"]), 2)
        for words in (("robot", "-d", viewer, "disable"), ("robot", "-d", viewer, "run", "circle"),
                      ("--role", "operator", "robot", "-d", viewer, "disable")):
            answer = system.run(*words)
            self.assertEqual(answer.returncode, 1, answer.stdout)
            self.assertRegex(answer.stderr, "console-viewer may read topics and stop|role console-operator: .*found nothing")
        self.assertEqual(running.states(), ["ENABLED"] * 2)
        self.assert_ok(system.run("robot", "-d", viewer, "stop"))
        system.until(lambda: running.states() == ["FAULT"] * 2, 10, "a viewer's stop is obeyed")

    @unittest.skipUnless(os.geteuid() == 0, "listening to the wire needs root")
    def test_what_was_recorded_on_the_wire_and_is_sent_again_does_nothing(self):
        running = self.begin()
        listener = Listener(self.domain)
        for words in (("enable",), ("run", self.trajectory("short", [0, 2, 0], points=2))):
            self.assert_ok(running.robot(*words))
        self.assert_ok(running.robot("disable"))
        datagrams = listener.end()
        self.assertGreater(len(datagrams), 500)
        frames = [payload for _, payload in datagrams if b"arm_a" in payload or b"enable" in payload]
        self.assertEqual(frames, [], "something crosses the wire in the clear")
        stood = running.joints()
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(sender.close)
        for _ in range(2):
            for port, payload in datagrams:
                sender.sendto(payload, ("127.0.0.1", port))
            self.assertEqual(running.states(), ["DISABLED"] * 2)
        self.assertEqual(running.assert_still(self, looks=5), stood)
        self.assertEqual(running.status()["lease_owner"], 0)
        self.assert_ok(running.robot("enable"))
        self.assertEqual(running.states(), ["ENABLED"] * 2)


if __name__ == "__main__":
    system.main()
