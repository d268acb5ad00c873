# SPDX-License-Identifier: Apache-2.0
"""Hand-made requests and WebSockets, which can also be invalid."""
import base64
import json
import os
import socket
import ssl
import struct

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")


def connect(port, tls=None, timeout=20):
    """A TCP connection; `tls` is an ssl.SSLContext."""
    plain = socket.create_connection(("127.0.0.1", port), timeout=timeout)
    return tls.wrap_socket(plain, server_hostname="localhost") if tls else plain


def send_rest(connection, data):
    """Sends as much as the peer accepts; it may close the connection meanwhile."""
    try:
        connection.sendall(data)
    except (BrokenPipeError, ConnectionResetError, ssl.SSLError):
        pass


def read_all(connection):
    """Everything until the peer closes."""
    data = b""
    try:
        while True:
            part = connection.recv(65536)
            if not part:
                return data
            data += part
    except (ConnectionResetError, ssl.SSLError):
        return data


def get(port, path, tls=None, method="GET", **headers):
    """Status, headers and body of one request."""
    lines = {"Host": f"localhost:{port}", "Connection": "close",
             **{name.replace("_", "-"): value for name, value in headers.items()}}
    with connect(port, tls) as connection:
        head = "".join(f"{name}: {value}\r\n" for name, value in lines.items() if value is not None)
        connection.sendall(f"{method} {path} HTTP/1.1\r\n{head}\r\n".encode("latin-1"))
        answer = read_all(connection)
    head, _, body = answer.partition(b"\r\n\r\n")
    lines = head.decode("latin-1").split("\r\n")
    return int(lines[0].split()[1]), dict(line.split(": ", 1) for line in lines[1:]), body


def api(port, name, tls=None, **headers):
    status, _, body = get(port, f"/api/{name}", tls, **headers)
    assert status == 200, (status, body)
    return json.loads(body)


class Refused(Exception):
    """The server refuses the WebSocket."""

    def __init__(self, status, body):
        super().__init__(f"{status}: {body}")
        self.status = status


class WebSocket:
    """A client of the protocol. `query`, `headers`: of the opening request."""

    def __init__(self, port, tls=None, query="", subprotocol=SUBPROTOCOLS[0], **headers):
        self.socket = connect(port, tls)
        lines = {"Host": f"localhost:{port}", "Upgrade": "websocket", "Connection": "Upgrade",
                 "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), "Sec-WebSocket-Version": "13",
                 "Sec-WebSocket-Protocol": subprotocol, **headers}
        head = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
        self.socket.sendall(f"GET /{query} HTTP/1.1\r\n{head}\r\n".encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            part = self.socket.recv(65536)
            if not part:
                raise Refused(0, self.buffer)
            self.buffer += part
        answer, _, self.buffer = self.buffer.partition(b"\r\n\r\n")
        self.status = int(answer.split()[1])
        if self.status != 101:
            self.socket.close()
            raise Refused(self.status, self.buffer)
        assert f"Sec-WebSocket-Protocol: {subprotocol}".encode() in answer, answer
        self.channels = {}

    def close(self):
        self.socket.close()

    def _take(self, count):
        while len(self.buffer) < count:
            part = self.socket.recv(1 << 20)
            if not part:
                raise ConnectionError("the server hung up")
            self.buffer += part
        data, self.buffer = self.buffer[:count], self.buffer[count:]
        return data

    def frame(self):
        """The next frame, as (opcode, payload); pings are answered."""
        while True:
            first, second = self._take(2)
            size = second & 0x7F
            if size > 125:
                size = struct.unpack(">H" if size == 126 else ">Q", self._take(2 if size == 126 else 8))[0]
            payload = self._take(size)
            if first & 0x0F != 9:
                return first & 0x0F, payload
            self.send(payload, 10)

    def send(self, payload, opcode=2, final=0x80):
        size = len(payload)
        head = bytes([final | opcode])
        head += (bytes([0x80 | size]) if size < 126 else bytes([0xFE]) + struct.pack(">H", size) if size < 65536
                 else bytes([0xFF]) + struct.pack(">Q", size))
        mask = os.urandom(4)
        repeated = (mask * (size // 4 + 1))[:size]
        masked = (int.from_bytes(payload, "little") ^ int.from_bytes(repeated, "little")).to_bytes(size, "little")
        send_rest(self.socket, head + mask + masked)

    def say(self, op, **members):
        self.send(json.dumps({"op": op, **members}).encode(), 1)

    def text(self, op):
        """The next text message with this op; samples before it are dropped."""
        while True:
            opcode, payload = self.frame()
            if opcode == 8:
                raise ConnectionError(f"the server said goodbye: {payload}")
            if opcode == 1:
                message = json.loads(payload)
                if message["op"] == op:
                    return message

    def greet(self):
        """Reads the first messages to every client; stores channels by topic."""
        info = self.text("serverInfo")
        self.channels = {channel["topic"]: channel["id"] for channel in self.text("advertise")["channels"]}
        return info

    def subscribe(self, *topics, **more):
        """`more`: further members of each subscription."""
        ids = [self.channels[topic] for topic in topics]
        self.say("subscribe", subscriptions=[{"id": number, "channelId": number, **more} for number in ids])

    def publish(self, topic, schema, payload, number=1):
        self.say("advertise", channels=[{"id": number, "topic": topic, "encoding": "cdr", "schemaName": schema}])
        self.send(struct.pack("<BI", 1, number) + payload)


def cdr_stop(client, reason):
    """tandem_msgs/msg/Stop."""
    text = reason.encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<QQI", client, 1, len(text)) + text


def fingerprint(port, tls=None, **headers):
    """Fingerprint of the console's robot."""
    return int(api(port, "robot", tls, **headers)["fingerprint"], 16)


def cdr_control_request(robot, client, kind, seen=(0, 0)):
    """tandem_msgs/msg/ControlRequest without text. `robot`: a fingerprint; `seen`: session and sequence of the last control/status
    received."""
    body = struct.pack("<QQQBB2xI", robot, client, 1, kind, 255, 1) + b"\0" + b"\0" * 3 + struct.pack("<I", 1) + b"\0" + b"\0"
    body += b"\0" * (-len(body) % 8) + b"\0" * 64 + struct.pack("<QQ", *seen)
    return b"\0\1\0\0" + body
