# SPDX-License-Identifier: Apache-2.0
"""Two simulated hosts on one machine: network namespaces, and a link that can be cut, slow and lossy.

Each host has a tap device; the link is a thread that transfers frames from one to the other. It requires root and only namespaces and
tun from the kernel."""
import contextlib
import ctypes
import fcntl
import heapq
import itertools
import os
import random
import selectors
import struct
import subprocess
import threading
import time

TUNSETIFF, IFF_TAP, IFF_NO_PI = 0x400454CA, 0x0002, 0x1000
CLONE_NEWNET = 0x40000000
_numbers = itertools.count()


def missing():
    """Reason why this machine cannot simulate networks; None if it can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        return "/dev/net/tun is not there"
    probe = f"tandem-probe-{os.getpid()}"
    if subprocess.run(["ip", "netns", "add", probe], capture_output=True, check=False).returncode != 0:
        return "this system does not allow network namespaces"
    subprocess.run(["ip", "netns", "del", probe], check=False)
    return None


class Host:
    """A network namespace with one interface. `inside` is the prefix of commands that run in it."""

    def __init__(self, name, address):
        self.address = address
        self.namespace = f"tandem-{name}-{os.getpid()}-{next(_numbers)}"
        self.inside = ["ip", "netns", "exec", self.namespace]
        subprocess.run(["ip", "netns", "add", self.namespace], check=True)
        try:
            self.tap = self._open_tap()
            for words in ("link set lo up", f"addr add {address}/24 dev tap0", "link set tap0 up"):
                subprocess.run([*self.inside, "ip", *words.split()], check=True)
            # As in docs/two-hosts.md: incomplete datagrams must not wait 30 s for lost fragments and fill the kernel's memory.
            subprocess.run([*self.inside, "sh", "-c", "echo 1 > /proc/sys/net/ipv4/ipfrag_time"], check=True)
        except BaseException:
            self.close()
            raise

    def _open_tap(self):
        libc = ctypes.CDLL(None, use_errno=True)
        here, there = os.open("/proc/thread-self/ns/net", os.O_RDONLY), os.open(f"/run/netns/{self.namespace}", os.O_RDONLY)
        try:
            if libc.setns(there, CLONE_NEWNET) != 0:
                raise OSError(ctypes.get_errno(), "setns")
            tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
            fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH22x", b"tap0", IFF_TAP | IFF_NO_PI))
            return tap
        finally:
            libc.setns(here, CLONE_NEWNET)
            os.close(here)
            os.close(there)

    def close(self):
        if getattr(self, "tap", None) is not None:
            os.close(self.tap)
            self.tap = None
        subprocess.run(["ip", "netns", "del", self.namespace], capture_output=True, check=False)


class Wire(threading.Thread):
    """Transfers frames between two hosts, each with `delay` s and up to `jitter` s more (which reorders them); loses a share `loss` of
    them, duplicates a share `duplicates`. While `cut` is set, no frame passes."""

    def __init__(self, one, other, seed=0):
        super().__init__(daemon=True)
        self.delay = self.jitter = self.loss = self.duplicates = 0.0
        self.cut = False
        self.carried = self.dropped = 0
        self._random = random.Random(seed)
        self._ends = {one.tap: other.tap, other.tap: one.tap}
        self._waiting, self._order, self._ended = [], itertools.count(), False
        self.start()

    def run(self):
        # A real link needs no processor: its thread has priority over processes that load the processors.
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
        selector = selectors.DefaultSelector()
        for tap in self._ends:
            selector.register(tap, selectors.EVENT_READ)
        while not self._ended:
            wait = self._waiting[0][0] - time.monotonic() if self._waiting else 0.05
            for key, _ in selector.select(max(0.0, min(wait, 0.05))):
                self._fetch(key.fd)
            while self._waiting and self._waiting[0][0] <= time.monotonic():
                _, _, to, frame = heapq.heappop(self._waiting)
                self._deliver(to, frame)
        selector.close()

    def _fetch(self, source):
        while True:
            try:
                frame = os.read(source, 65536)
            except BlockingIOError:
                return
            if self.cut or self._random.random() < self.loss:
                self.dropped += 1
                continue
            for _ in range(2 if self._random.random() < self.duplicates else 1):
                due = time.monotonic() + self.delay + self._random.random() * self.jitter
                heapq.heappush(self._waiting, (due, next(self._order), self._ends[source], frame))

    def _deliver(self, to, frame):
        if self.cut:
            self.dropped += 1
            return
        try:
            os.write(to, frame)
            self.carried += 1
        except OSError:
            self.dropped += 1  # the queue is full

    def close(self):
        self._ended = True
        self.join(5)
