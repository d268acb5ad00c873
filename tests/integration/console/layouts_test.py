#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""All topics and fields of the shipped layouts exist."""
import json
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

LAYOUTS = system.SOURCE / "console" / "layouts"
ARRAY = re.compile(r"(\w+)(?:\[(\d+)\])?$")
BASIC = re.compile(r"(u?int(8|16|32|64)|float(32|64)|bool|string)$")


def members(kind):
    """Type and bound of every member of a message, from its definition."""
    package, _, name = kind.replace("/msg/", "/").partition("/")
    found = {}
    for line in (system.SOURCE / "idl" / "msg" / package / f"{name}.msg").read_text().splitlines():
        match = re.match(r"([\w/]+)(\[(\d*)\])? (\w+)", line)
        if match and not line.startswith("#"):
            element = match[1]
            if not BASIC.match(element) and "/" not in element:
                element = f"{package}/{element}"
            found[match[4]] = (element, match[2] is not None, match[3])
    return found


class Layouts(unittest.TestCase):
    def setUp(self):
        topics = json.loads(system.run("topics", "laptop", "--json").stdout)
        self.topics = {topic["topic"]: topic["type"] for topic in topics}

    def assert_field(self, topic, fields, where):
        self.assertIn(topic, self.topics, where)
        kind = self.topics[topic]
        for field in fields:
            name, index = ARRAY.match(field).groups()
            self.assertFalse(BASIC.match(kind), f"{where}: {name} of a {kind}")
            known = members(kind)
            self.assertIn(name, known, f"{where}: {kind} has no such member")
            kind, is_list, bound = known[name]
            self.assertEqual(index is not None, is_list, where)
            if index and bound:
                self.assertLess(int(index), int(bound), where)
        return kind

    def test_lichtblick(self):
        layout = json.loads((LAYOUTS / "lichtblick.json").read_text())
        panels = set(re.findall(r'"([A-Za-z0-9]+![a-z]+)"', json.dumps(layout["layout"])))
        self.assertEqual(panels, set(layout["configById"]))
        seen = 0

        def walk(value):
            nonlocal seen
            if isinstance(value, dict):
                for key, member in value.items():
                    walk(key)
                    walk(member)
            elif isinstance(value, list):
                for member in value:
                    walk(member)
            elif isinstance(value, str) and value.startswith("/"):
                topic, *fields = value.split(".")
                self.assert_field(topic, fields, value)
                seen += 1

        walk(layout)
        self.assertGreater(seen, 15)

    def test_plotjuggler(self):
        curves = xml.etree.ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot().iter("curve")
        names = [curve.get("name") for curve in curves]
        self.assertGreater(len(names), 15)
        for name in names:
            topic = max((known for known in self.topics if name.startswith(known + "/")), key=len, default=None)
            self.assertIsNotNone(topic, name)
            kind = self.assert_field(topic, name[len(topic) + 1:].split("/"), name)
            self.assertRegex(kind, BASIC, f"{name}: a number can be plotted")


if __name__ == "__main__":
    system.main()
