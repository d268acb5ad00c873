# SPDX-License-Identifier: Apache-2.0
"""Conversion of candump logs to packet captures, and their check by tshark's CANopen dissector."""
import collections
import pathlib
import struct
import subprocess

LINKTYPE_CAN_SOCKETCAN = 227
EXTENDED, REMOTE = 0x80000000, 0x40000000


def frames(log):
    """(seconds, identifier with flags, payload) of each line of a candump log."""
    for line in pathlib.Path(log).read_text().splitlines():
        stamp, _, text = line.split()[:3]
        name, payload = text.split("#", 1)
        identifier = int(name, 16) | (EXTENDED if len(name) > 3 else 0)
        if payload.startswith("R"):
            identifier, payload = identifier | REMOTE, ""
        yield float(stamp.strip("()")), identifier, bytes.fromhex(payload)


def write_capture(log, capture):
    """Writes the capture. Returns the number of frames."""
    count = 0
    with open(capture, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 0x40000, LINKTYPE_CAN_SOCKETCAN))
        for seconds, identifier, payload in frames(log):
            packet = struct.pack(">IBxxx8s", identifier, len(payload), payload)
            file.write(struct.pack("<IIII", int(seconds), int(seconds % 1 * 1e6), len(packet), len(packet)) + packet)
            count += 1
    return count


def dissect(log):
    """Result of the dissector for all frames: (counts by kind, complaints)."""
    capture = pathlib.Path(log).with_suffix(".pcap")
    count = write_capture(log, capture)
    fields = ("frame.protocols", "_ws.malformed", "_ws.expert.severity", "_ws.col.Info", "can.id")
    command = ["tshark", "-n", "-r", str(capture), "-d", "can.subdissector,canopen", "-T", "fields", "-E",
               "separator=|", "-E", "occurrence=f"]
    for field in fields:
        command += ["-e", field]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    kinds, complaints = collections.Counter(), []
    lines = answer.stdout.splitlines()
    for number, line in enumerate(lines, 1):
        protocols, malformed, severity, info, identifier = line.split("|")
        # Wireshark shows a SYNC without counter, which has no data bytes, only as CAN.
        canopen = "canopen" in protocols or int(identifier) == 0x80
        if malformed or severity or not canopen or "nknown" in info or "eserved" in info:
            complaints.append(f"frame {number}: {line}")
        kinds[info.split("[")[0].strip()] += 1
    if len(lines) != count:
        complaints.append(f"{count} frames, {len(lines)} dissected")
    return kinds, complaints
