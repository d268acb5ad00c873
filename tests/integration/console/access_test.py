#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Access to tandem-console: TLS, tokens, roles, and DDS Security behind it."""
import json
import os
import socket
import ssl
import struct
import subprocess
import sys
import time

from console import LONG_PERIODS, HERE, OPERATOR, VIEWER, ConsoleTest
import system
import wire

sys.path.insert(0, str(HERE.parent / "security"))
from credentials import Authority  # noqa: E402


class Secured(ConsoleTest):
    """DDS Security: the console has a role of its own, and requires tokens for every request."""

    def test_console_acts_for_clients_with_a_token(self):
        self.port, self.prefix, domain = system.free_port(), f"t{os.getpid()}", system.free_domain()
        authority = Authority(self.folder / "credentials", self.prefix, domain)
        authority.issue("control", "hal", "planning", "recorder", "console-operator")
        token = self.folder / "operator"
        token.write_text(OPERATOR)
        token.chmod(0o600)
        keys = {"prefix": self.prefix, "domain": domain, "security": authority.folder, **LONG_PERIODS,
                "budgets": "{minimum_age_ms: 3000, planning_reference_ms: 5000, lease_ms: 9000}"}
        for console, why in ((f"{{port: {self.port}, operator_token: operator}}", "role console: "),
                             (f"{{port: {self.port}}}", "console.operator_token: is missing")):
            path = system.deployment(self.folder, "laptop", console=console, **keys)
            answer = system.run("--deployment", path, program="tandem-console")
            self.assertNotEqual(answer.returncode, 0)
            self.assertIn(why, answer.stderr)
        authority.issue("console")
        self.start("laptop", console=f"{{port: {self.port}, operator_token: operator}}", **keys)
        system.until(self.healthy, 20, "the console serves")
        with self.assertRaises(wire.Refused) as refused:
            wire.WebSocket(self.port)
        self.assertEqual(refused.exception.status, 401)
        peer = self.client("control/status", "control/reply", "actuation/command", query=f"?token={OPERATOR}")

        def received(name):
            return struct.pack("<BI", 1, peer.channels[f"/{self.prefix}/{name}"])

        for name in ("control/status", "actuation/command"):
            while not peer.frame()[1].startswith(received(name)):
                pass
        robot = wire.fingerprint(self.port, Authorization=f"Bearer {OPERATOR}")
        # A request that leaves before the console's new writer and control know each other is lost: it is repeated.
        deadline = time.monotonic() + 60
        published, seen = 0.0, None
        while not (frame := peer.frame()[1]).startswith(received("control/reply")):
            self.assertLess(time.monotonic(), deadline, "no reply of control")
            if frame.startswith(received("control/status")):
                seen = struct.unpack_from("<QQ", frame, 13 + 4 + 8)
            if seen and time.monotonic() > published + 1.0:
                peer.publish(f"/{self.prefix}/control/request", "tandem_msgs/msg/ControlRequest",
                             wire.cdr_control_request(robot, 7, 1, seen))
                published = time.monotonic()
        client, number, accepted = struct.unpack_from("<QQB", frame, 13 + 4)
        self.assertEqual((client, number, accepted), (7, 1, 1), "the lease")


class Tokens(ConsoleTest):
    """The console without other services, on a TLS port: access to its endpoints by role."""

    def setUp(self):
        super().setUp()
        self.port, self.prefix = system.free_port(), f"t{os.getpid()}"
        for name, text in (("operator", OPERATOR), ("viewer", VIEWER)):
            (self.folder / name).write_text(text + "\n")
            (self.folder / name).chmod(0o600)
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                        "-keyout", self.folder / "key.pem", "-out", self.folder / "certificate.pem"],
                       check=True, capture_output=True)
        self.tls = ssl.create_default_context(cafile=str(self.folder / "certificate.pem"))

    def serve(self, keys):
        path = system.deployment(self.folder, "laptop", prefix=self.prefix, console=f"{{port: {self.port}, {keys}}}")
        self.process = subprocess.Popen([system.executable("tandem-console"), "--deployment", str(path), "--log", "warn"],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(system.reap, self.process)

    def test_tls_and_tokens(self):
        self.serve("certificate: certificate.pem, key: key.pem, operator_token: operator, viewer_token: viewer")
        system.until(lambda: self.healthy(self.tls), 20, "it serves")
        with wire.connect(self.port, self.tls) as connection:
            self.assertIn(connection.version(), ("TLSv1.2", "TLSv1.3"))
        with wire.connect(self.port) as plain:
            plain.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.assertNotIn(b"HTTP", wire.read_all(plain), "nothing without TLS")
        for wrong in ("", "?token=", f"?token={OPERATOR}x", f"?token={OPERATOR[:-1]}", f"?token={VIEWER.upper()}"):
            with self.assertRaises(wire.Refused) as refused:
                wire.WebSocket(self.port, self.tls, wrong)
            self.assertEqual(refused.exception.status, 401)
            self.assertEqual(wire.get(self.port, f"/api/robot{wrong}", self.tls)[0], 401)
        self.assertEqual(wire.get(self.port, "/healthz", self.tls)[0], 200)
        self.roles()
        self.cookie()
        self.crowd()

    def crowd(self):
        """Connections without a token do not lock others out, whatever their number and behaviour."""
        silent = [wire.connect(self.port) for _ in range(110)]
        asked = [wire.connect(self.port, self.tls) for _ in range(10)]
        for connection in asked:
            connection.sendall(b"GET /api/robot HTTP/1.1\r\nHost: localhost\r\nConnection: keep-alive\r\n\r\n")
            self.assertIn(b"401", wire.read_all(connection), "it is hung up on")
        self.assertEqual(wire.api(self.port, "robot", self.tls, Authorization=f"Bearer {OPERATOR}")["role"], "operator")
        for connection in silent + asked:
            connection.close()

    def roles(self):
        for token, role in ((OPERATOR, "operator"), (VIEWER, "viewer")):
            self.assertEqual(wire.api(self.port, "robot", self.tls, Authorization=f"Bearer {token}")["role"], role)
        viewer = wire.WebSocket(self.port, self.tls, f"?token={VIEWER}")
        self.addCleanup(viewer.close)
        viewer.greet()
        viewer.publish(f"/{self.prefix}/control/request", "tandem_msgs/msg/ControlRequest", wire.cdr_control_request(1, 7, 1))
        self.assertIn("console-viewer may not publish it", viewer.text("status")["message"])
        self.assertIn("not advertised, or its advertisement was refused", viewer.text("status")["message"])
        viewer.publish(f"/{self.prefix}/stop", "tandem_msgs/msg/Stop", wire.cdr_stop(7, "enough"), 2)
        self.assertIn("no subscriber", viewer.text("status")["message"], "it was carried; there is no robot")
        operator = wire.WebSocket(self.port, self.tls, Cookie=f"a=b; tandem_token_{self.port}={OPERATOR}")
        self.addCleanup(operator.close)
        operator.greet()
        operator.publish(f"/{self.prefix}/control/request", "tandem_msgs/msg/ControlRequest", wire.cdr_control_request(1, 7, 1))
        self.assertIn("no subscriber", operator.text("status")["message"])
        self.assertEqual(wire.api(self.port, "stats", self.tls, Authorization=f"Bearer {OPERATOR}")["published"], 2)

    def cookie(self):
        """The browser keeps a valid token as a cookie, and goes to the address without it; also by a link of another site."""
        cookie = f"^tandem_token_{self.port}={VIEWER}; Path=/; HttpOnly; SameSite=Strict; Secure$"
        for path, site, then in ((f"/?token={VIEWER}", "none", "/"), (f"/?a=b&token={VIEWER}&c", "cross-site", "/?a=b&c")):
            status, headers, _ = wire.get(self.port, path, self.tls, Sec_Fetch_Site=site)
            self.assertEqual((status, headers["Location"], headers["Cache-Control"]), (303, then, "no-store"))
            self.assertRegex(headers["Set-Cookie"], cookie)
        for path in ("/?token=wrong-token-0123456789", f"//evil.example/?token={VIEWER}", f"/index.html?token={VIEWER}"):
            status, headers, _ = wire.get(self.port, path, self.tls)
            self.assertNotEqual(status, 303)
            self.assertNotIn("Set-Cookie", headers)
        status, headers, body = wire.get(self.port, "/api/robot", self.tls)
        self.assertEqual((status, headers["WWW-Authenticate"]), (401, "Bearer"))
        for step in ("requires a token", "viewer_token", "/?token=TOKEN", "Authorization: Bearer TOKEN"):
            self.assertIn(step, json.loads(body)["error"])

    def test_what_is_not_good_is_refused(self):
        (self.folder / "open").write_text(OPERATOR)
        (self.folder / "open").chmod(0o644)
        for keys, why in (("operator_token: open", "open: found a file that every user of this machine can read"),
                          ("operator_token: nowhere", "nowhere: cannot be opened"),
                          ("certificate: operator, key: key.pem", "console.certificate: .*operator"),
                          ("certificate: certificate.pem, key: operator", "console.key: .*operator"),
                          ("certificate: certificate.pem, key: open", "console.key: .*open: found a file that every user"),
                          ("address: 0.0.0.0", "expected certificate and key")):
            self.serve(keys)
            self.assertNotEqual(self.process.wait(20), 0, keys)
            self.assertRegex(self.process.stderr.read(), why)
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", self.port))
            taken.listen()
            self.serve("operator_token: operator")
            self.assertNotEqual(self.process.wait(20), 0)
            self.assertIn(f"127.0.0.1:{self.port}", self.process.stderr.read())

    def test_the_command_line_says_where_it_is(self):
        path = system.deployment(self.folder, "laptop", prefix=self.prefix, console=f"{{port: {self.port}, operator_token: operator}}")
        answer = self.assert_ok(system.run("console", path, "--url"))
        self.assertIn(f"http://127.0.0.1:{self.port}/", answer.stdout)
        self.assertNotIn(OPERATOR, answer.stdout)
        process = subprocess.Popen([system.executable(), "console", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(system.reap, process)
        system.until(self.healthy, 20, "it serves")
        self.assertIn("it is already served", self.assert_ok(system.run("console", path)).stdout)


if __name__ == "__main__":
    system.main()
