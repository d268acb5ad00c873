# SPDX-License-Identifier: Apache-2.0
"""A robot with a console, for tests."""
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "harness"))
import system  # noqa: E402
import wire  # noqa: E402

OPERATOR, VIEWER = "operator-token-0123456789", "viewer-token-0123456789"
LONG_PERIODS = {"control_period_s": "0.05", "sim_period_ms": "2"}


class ConsoleTest(system.SystemTest):
    def start_robot(self):
        """Robot and console without tokens."""
        self.port = system.free_port()
        self.prefix = f"t{os.getpid()}"
        robot = self.start("laptop", prefix=self.prefix, console=f"{{port: {self.port}}}", **LONG_PERIODS)
        system.until(lambda: self.healthy(), 20, "the console serves")
        return robot

    def healthy(self, tls=None):
        try:
            return wire.get(self.port, "/healthz", tls)[0] == 200
        except OSError:
            return False

    def stats(self, tls=None, **headers):
        return wire.api(self.port, "stats", tls, **headers)

    def channel(self, peer, name):
        return peer.channels[f"/{self.prefix}/{name}"]

    def client(self, *topics, **options):
        peer = wire.WebSocket(self.port, **options)
        self.addCleanup(peer.close)
        peer.greet()
        peer.subscribe(*(f"/{self.prefix}/{topic}" for topic in topics))
        return peer
