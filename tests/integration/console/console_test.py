#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tandem-console with correct and faulty clients: Foxglove's own client, many clients, and invalid requests."""
import json
import os
import pathlib
import select
import signal
import socket
import struct
import subprocess
import threading
import time

from console import HERE, LONG_PERIODS, ConsoleTest
import system
import wire


class Peer(ConsoleTest):
    """Needs npm's packages in NODE_PATH."""

    def run_peer(self, subprotocol, task):
        answer = subprocess.run(["node", HERE / "foxglove_peer.js", f"ws://127.0.0.1:{self.port}", subprotocol, self.prefix,
                                 task], capture_output=True, text=True, timeout=100, check=False)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        return json.loads(answer.stdout)

    def test_foxgloves_own_client(self):
        self.start_robot()
        topics = json.loads(self.assert_ok(system.run("topics", self.folder / "laptop.yaml", "--json")).stdout)
        for subprotocol, task in zip(wire.SUBPROTOCOLS, ("watch", "command")):
            found = self.run_peer(subprotocol, task)
            print(subprotocol, found, flush=True)
            self.assertEqual(found["channels"], len(topics))
        self.assertIn(found["reason"][:20], found["log"])
        system.until(lambda: self.stats()["clients"] == [], 10, "both have gone")
        system.until(lambda: self.stats()["topics_read"] < len(topics) / 5, 10, "only values, replies and events are read for nobody")


class Crowd(ConsoleTest):
    def test_ten_clients_and_one_that_stops_reading(self):
        self.start_robot()
        wanted = ("actuation/state", "actuation/limits", "control/status", "arm_a/shape", "arm_b/shape", "arm_a/measured_js")
        readers = [self.client(*wanted) for _ in range(9)]
        counts, over = [0] * len(readers), threading.Event()

        def read():
            by_socket = {peer.socket: (index, peer) for index, peer in enumerate(readers)}
            while not over.is_set():
                for ready in select.select(list(by_socket), [], [], 0.2)[0]:
                    index, peer = by_socket[ready]
                    peer.buffer += ready.recv(1 << 20)
                    while len(peer.buffer) > 14:  # complete frames only
                        size = peer.buffer[1] & 0x7F
                        head = 2 + {126: 2, 127: 8}.get(size, 0)
                        if size > 125:
                            size = int.from_bytes(peer.buffer[2:head], "big")
                        if len(peer.buffer) < head + size:
                            break
                        if peer.buffer[0] & 0x0F == 9:
                            peer.send(peer.buffer[head:head + size], 10)
                        counts[index] += peer.buffer[0] & 0x0F == 2
                        peer.buffer = peer.buffer[head + size:]

        lazy = self.client(*wanted)
        lazy.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        thread = threading.Thread(target=read)
        thread.start()
        self.addCleanup(lambda: (over.set(), thread.join()))
        system.until(lambda: min(counts) > 100, 20, "all nine receive")
        before, began = list(counts), time.monotonic()
        system.until(lambda: self.stats()["cut_off"] == 1, 60, "who does not read is cut off")
        seconds = time.monotonic() - began
        rates = [(count - first) / seconds for count, first in zip(counts, before)]
        stats = self.stats()
        self.assertEqual(len(stats["clients"]), 9)
        print(f"9 clients, {min(rates):.0f} to {max(rates):.0f} samples/s each, cpu {stats['cpu']:.2f} of a core, "
              f"{stats['bytes_per_second'] / 9 / 1000:.0f} kB/s a client, cut off after {seconds:.1f} s", flush=True)
        self.assertGreater(min(rates), 0.5 * max(rates), "nobody is left behind")
        dropped = [client["dropped"] for client in stats["clients"]]
        print("left out:", dropped, flush=True)

    def rates(self):
        """At ?rate=10, ten samples per second of a 500 Hz best-effort topic; all samples of a reliable one."""
        peer = self.client("actuation/state", "arm_a/measured_js", query="?rate=10")
        times = {self.channel(peer, name): [] for name in ("actuation/state", "arm_a/measured_js")}
        while min(map(len, times.values())) < 15:
            opcode, payload = peer.frame()
            if opcode == 2:
                times[struct.unpack_from("<I", payload, 1)[0]].append(struct.unpack_from("<Q", payload, 5)[0] / 1e9)
        states, joints = times.values()
        self.assertGreater(states[-1] - states[1], 0.09 * (len(states) - 2))
        self.assertLess(min(b - a for a, b in zip(joints, joints[1:])), 0.09, "20 a second")
        self.subscription_rates()
        for wrong in ("0", "-1", "1e9", "fast", "10x"):
            with self.assertRaises(wire.Refused) as refused:
                wire.WebSocket(self.port, query=f"?rate={wrong}")
            self.assertEqual(refused.exception.status, 400)

    def subscription_rates(self):
        """A subscription's own rate; at one sample in 10 s, a state that changes comes at once."""
        peer = self.client(query="?rate=1000")
        names = [f"/{self.prefix}/{name}" for name in ("actuation/state", "hal/status")]
        peer.subscribe(names[0], rate=20)
        peer.subscribe(names[1], rate=0.1)
        times = {peer.channels[name]: [] for name in names}
        states, drives = times.values()

        def receive(enough):
            while not enough():
                opcode, payload = peer.frame()
                if opcode == 2:
                    times[struct.unpack_from("<I", payload, 1)[0]].append(struct.unpack_from("<Q", payload, 5)[0] / 1e9)

        receive(lambda: len(states) > 30 and drives)
        self.assertGreater(states[-1] - states[1], 0.045 * (len(states) - 2))
        self.assertLess(len(drives), 5, "nothing happens but that the robot has started")
        before = len(drives)
        peer.publish(f"/{self.prefix}/stop", "tandem_msgs/msg/Stop", wire.cdr_stop(7, "enough"), 2)
        receive(lambda: len(drives) > before)
        self.assertLess(drives[before] - drives[before - 1], 9.5, "it waited for its interval")
        for wrong in (0, -1, 1001, "10", None):
            peer.subscribe(names[0], rate=wrong)
            self.assertIn("rate: expected a number from 0.1 to 1000", peer.text("status")["message"])

    def test_rates_and_close_frame(self):
        robot = self.start_robot()
        self.rates()
        peer = self.client("control/status")
        os.kill(robot.pids["console"], signal.SIGTERM)
        frames = []
        while not frames or frames[-1][0] != 8:
            frames.append(peer.frame())
        self.assertEqual(struct.unpack(">H", frames[-1][1][:2])[0], 1001, "going away")
        why = "tandem-console ended: SIGTERM"
        self.assertTrue(frames[-1][1][2:].decode().startswith(why), frames[-1])
        self.assertTrue(json.loads(frames[-2][1])["message"].startswith(why), "the last message before the end is its reason")
        robot.event("lost", 10)
        self.assertEqual(len(robot.states()), 2, "the robot goes on")


class Openings(ConsoleTest):
    """The server's memory does not grow with the number of times that a page has been opened."""

    def megabytes(self, pid):
        lines = pathlib.Path(f"/proc/{pid}/status").read_text().splitlines()
        return int(next(line.split()[1] for line in lines if line.startswith("VmRSS"))) / 1024

    def test_memory_is_flat(self):
        pid = self.start_robot().pids["console"]
        found = []
        for _ in range(12):
            wire.get(self.port, "/")
            peer = self.client()
            peer.subscribe(*peer.channels)
            missing = {self.channel(peer, name) for name in ("control/status", "diagnostics", "arm_a/shape")}
            while missing:
                opcode, payload = peer.frame()
                if opcode == 2:
                    missing.discard(struct.unpack_from("<I", payload, 1)[0])
            peer.close()
            system.until(lambda: self.stats()["clients"] == [], 20, "it is gone")
            found.append(self.megabytes(pid))
        print("MB after each opening:", *(f"{size:.0f}" for size in found), flush=True)
        self.assertLess(max(found), found[0] + 40)


class Killed(ConsoleTest):
    """A server that is killed leaves the events that its clients have received."""

    def serve(self, path):
        """Runs until it is killed."""
        console = subprocess.Popen([system.executable("tandem-console"), "--deployment", str(path), "--log", "warn"])
        self.addCleanup(console.wait)
        self.addCleanup(console.kill)
        system.until(self.healthy, 60, "the console serves")
        return console

    def events(self):
        status, _, body = wire.get(self.port, "/api/events")
        self.assertEqual(status, 200)
        return body

    def test_events_survive(self):
        self.port = system.free_port()
        robot = self.start("laptop", without=("console",), console=f"{{port: {self.port}}}", **LONG_PERIODS)
        known = []
        for _ in range(5):
            console = self.serve(robot.path)
            stop = system.client(robot.path, "stop")
            self.addCleanup(system.reap, stop)
            words = f"(pid {stop.pid} on".encode()
            system.until(lambda: words in self.events(), 60, "the stop is an event")  # pylint: disable=cell-var-from-loop
            # Its thread writes within milliseconds; a busy machine gets half a second, a quarter of what was lost once.
            with self.assertRaises(subprocess.TimeoutExpired):
                console.wait(0.5)
            console.kill()
            console.wait()
            known.append(words)
        self.serve(robot.path)
        found = self.events()
        self.assertEqual([words for words in known if words not in found], [], "lost")


class Hostile(ConsoleTest):
    def setUp(self):
        super().setUp()
        self.robot = self.start_robot()
        self.random = system.seeded(self)

    def assert_unharmed(self, published=0):
        self.assertEqual(self.stats()["published"], published, "a command was accepted")
        self.assertIn(self.robot.pids["console"], system.processes_of("tandem-console"))

    def test_invalid_requests_do_no_harm(self):
        """One robot for all cases: starting it takes most of the time."""
        slow = self.begin_slow()
        self.origins_and_hosts()
        self.duplicates()
        self.paths()
        self.fuzzed_requests()
        self.fuzzed_frames()
        self.oversized()
        self.slow_ones_are_cut_off(slow)
        self.assert_unharmed()
        # Valid clients are still served.
        peer = self.client("control/status", "control/reply")
        request = wire.cdr_control_request(wire.fingerprint(self.port), 7, 1)
        peer.publish(f"/{self.prefix}/control/request", "tandem_msgs/msg/ControlRequest", request)
        answer = struct.pack("<BI", 1, self.channel(peer, "control/reply"))
        while not peer.frame()[1].startswith(answer):
            pass
        self.assert_unharmed(1)

    def origins_and_hosts(self):
        evil = "http://evil.example"
        for headers in ({"Origin": evil}, {"Origin": "null"}, {"Origin": f"http://localhost:{self.port + 1}"},
                        {"Host": f"evil.example:{self.port}"},
                        {"Host": f"evil.example:{self.port}", "Origin": f"http://evil.example:{self.port}"}):
            with self.assertRaises(wire.Refused, msg=headers) as refused:
                wire.WebSocket(self.port, **headers)
            self.assertEqual(refused.exception.status, 403)
            self.assertEqual(wire.get(self.port, "/api/robot", **headers)[0], 403, headers)
        self.assertEqual(wire.get(self.port, "/api/robot", Sec_Fetch_Site="cross-site")[0], 403)
        with self.assertRaises(wire.Refused) as refused:
            wire.WebSocket(self.port, subprotocol="chat")
        self.assertEqual(refused.exception.status, 400)
        wire.WebSocket(self.port, Origin=f"http://localhost:{self.port}").close()

    def duplicates(self):
        """Two values for what decides on access: another reader on the way could take the other one."""
        here = f"Host: localhost:{self.port}"
        for path, lines in (("/healthz", (here, here)), ("/healthz", (here, "host: evil.example")), ("/", (here, here)),
                            ("/api/robot", (here, "Origin: http://evil.example", f"Origin: http://localhost:{self.port}")),
                            ("/api/robot", (here, "Authorization: Bearer a", "Authorization: Bearer b")),
                            ("/api/robot", (here, "Cookie: a=b", "Cookie: a=c")),
                            ("/api/robot?token=a&token=b", (here,)), ("/?rate=1&a&rate=2", (here,)),
                            ("/healthz", (here, "Content-Length: 0", "Content-Length: 5")),
                            ("/healthz", (here, "Content-Length: 0", "Transfer-Encoding: chunked"))):
            upgrade = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                       "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", f"Sec-WebSocket-Protocol: {wire.SUBPROTOCOLS[0]}")
            for more in ((), upgrade):
                with wire.connect(self.port) as connection:
                    connection.sendall("\r\n".join((f"GET {path} HTTP/1.1", *lines, *more, "", "")).encode())
                    answer = wire.read_all(connection)
                self.assertIn(b" 400 ", answer[:20], (path, lines, answer[:300]))

    def paths(self):
        for path in ("/../etc/passwd", "/..%2f..%2fetc/passwd", "/api/../etc", "/api/nothing", "/.git/config", "//etc/passwd"):
            self.assertEqual(wire.get(self.port, path)[0], 404, path)
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE"):
            self.assertEqual(wire.get(self.port, "/api/robot", method=method)[0], 405, method)
        status, headers, _ = wire.get(self.port, "/")
        self.assertEqual(status, 200)
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        self.assertEqual(wire.get(self.port, "/", method="HEAD")[2], b"")
        robot = wire.api(self.port, "robot")
        self.assertEqual([arm["name"] for arm in robot["arms"]], ["arm_a", "arm_b"])
        self.assertEqual(robot["role"], "operator")
        self.assertAlmostEqual(robot["arms"][0]["tubes"][0]["length"], 0.43, delta=0.2)
        trajectories = {entry["name"]: entry["yaml"] for entry in wire.api(self.port, "trajectories")}
        self.assertLessEqual({"circle", "line"}, set(trajectories))
        self.assertIn("trajectory/1", trajectories["circle"])

    def fuzzed_requests(self):
        good = f"GET /api/robot HTTP/1.1\r\nHost: localhost:{self.port}\r\nConnection: close\r\n\r\n".encode()
        for _ in range(150):
            data = bytearray(good[:self.random.randrange(len(good) + 1)])
            for _ in range(self.random.randrange(8)):
                data.insert(self.random.randrange(len(data) + 1), self.random.randrange(256))
            with wire.connect(self.port) as connection:
                wire.send_rest(connection, bytes(data))
                connection.shutdown(socket.SHUT_WR)
                answer = wire.read_all(connection)
            self.assertRegex(answer[:12], rb"^(HTTP/1\.1 \d|$)")
        for data, status in ((b"GET / HTTP/1.1\r\nHost: x\r\nX: " + b"a" * 20000 + b"\r\n\r\n", 431),
                             (b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n", 413),
                             (b"\x16\x03\x01\x02\x00\x01\x00" * 20 + b"\r\n\r\n", 400)):
            with wire.connect(self.port) as connection:
                wire.send_rest(connection, data)
                self.assertIn(f" {status} ".encode(), wire.read_all(connection)[:20])

    def fuzzed_frames(self):
        good = [json.dumps({"op": op, key: [{"id": 1, "channelId": 2, "topic": f"/{self.prefix}/stop", "encoding": "cdr",
                                             "schemaName": "tandem_msgs/msg/Stop"}]}).encode()
                for op, key in (("subscribe", "subscriptions"), ("unsubscribe", "subscriptionIds"), ("unadvertise", "channelIds"))]
        for _ in range(40):
            peer = wire.WebSocket(self.port)
            for _ in range(20):
                kind = self.random.randrange(4)
                if kind == 0:
                    text = bytearray(self.random.choice(good))
                    for _ in range(self.random.randrange(6)):
                        text[self.random.randrange(len(text))] = self.random.randrange(256)
                    peer.send(bytes(text), 1)
                elif kind == 1:  # the topic is never advertised: no sample of it may pass
                    peer.send(self.random.randbytes(self.random.randrange(60)), 2)
                elif kind == 2:
                    peer.send(self.random.randbytes(self.random.randrange(200)), self.random.randrange(16),
                              self.random.choice((0, 0x80, 0x40, 0xF0)))
                else:
                    wire.send_rest(peer.socket, self.random.randbytes(self.random.randrange(40)))
            peer.close()
        # Topics that do not exist, that only control may write, of other types and encodings.
        peer = self.client()
        for topic, schema, encoding in ((f"/{self.prefix}/actuation/command", "tandem_msgs/msg/ActuationCommand", "cdr"),
                                        (f"/{self.prefix}/control/status", "tandem_msgs/msg/ControlStatus", "cdr"),
                                        ("/other/control/request", "tandem_msgs/msg/ControlRequest", "cdr"),
                                        (f"/{self.prefix}/control/request", "tandem_msgs/msg/Stop", "cdr"),
                                        (f"/{self.prefix}/control/request", "tandem_msgs/msg/ControlRequest", "json")):
            peer.say("advertise", channels=[{"id": 5, "topic": topic, "encoding": encoding, "schemaName": schema}])
            self.assertIn(topic, peer.text("status")["message"])
            peer.send(struct.pack("<BI", 1, 5) + wire.cdr_control_request(wire.fingerprint(self.port), 7, 1))
            self.assertIn("not advertised, or its advertisement was refused", peer.text("status")["message"])

    def oversized(self):
        peer = self.client()
        wire.send_rest(peer.socket, b"\x82\xff" + struct.pack(">Q", 1 << 40) + b"\0" * 100)
        peer.socket.settimeout(20)
        try:
            while peer.frame()[0] != 8:
                pass
        except ConnectionError:
            pass

    def begin_slow(self):
        """An incomplete request, silent connections, a WebSocket whose peer is gone without a close frame."""
        slow = [wire.connect(self.port) for _ in range(3)]
        slow[0].sendall(b"GET / HTTP/1.1\r\nHost: ")
        half = self.client()
        half.socket.settimeout(40)
        return slow, half, time.monotonic()

    def slow_ones_are_cut_off(self, begun):
        slow, half, began = begun
        while slow:
            for connection in slow:
                wire.send_rest(connection, b"a")  # single bytes do not keep a connection open
            for connection in select.select(slow, [], [], 0.3)[0]:
                self.assertEqual(wire.read_all(connection), b"")
                connection.close()
                slow.remove(connection)
            self.assertLess(time.monotonic() - began, 40, "the server waits for ever")
        # Pings remain unanswered: the frames are read here without replies.
        wire.read_all(half.socket)
        self.assertLess(time.monotonic() - began, 40)


if __name__ == "__main__":
    system.main()
