# SPDX-License-Identifier: Apache-2.0
"""Random messages of every topic through `tandem export`: the exported values are the written ones."""
import csv
import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

OWN = ("time_s", "log_time_ns", "publish_time_ns", "sequence_of_writer")


def same_text(value):
    """Canonical text of a number, independent of its writer: one writer's 5.0 is another's 5."""
    if isinstance(value, bool) or (isinstance(value, float) and value.is_integer()):
        return str(int(value))
    return repr(value) if isinstance(value, float) else str(value)


class ExportedValues(system.SystemTest):
    def exported(self, folder):
        """Values of each row by topic, unordered; the two parts of a time as one."""
        found = {}
        for file in folder.iterdir():
            with open(file, newline="", encoding="utf-8") as stream:
                for row in csv.DictReader(stream):
                    values, text = [], {key: value for key, value in row.items() if key not in OWN}
                    for key in [key for key in text if key.endswith(".sec") and text[key]]:
                        seconds, rest = int(text.pop(key)), int(text.pop(key[:-3] + "nanosec"))
                        values.append(str(seconds * 10**9 + rest))
                    found.setdefault(int(row["log_time_ns"]), values).extend(text.values())
        return found

    def test_every_topic(self):
        seed = system.seeded(self).randrange(2**31)
        file = self.folder / "random.mcap"
        sample = pathlib.Path(system.executable()).parents[1] / "tests" / "message_sample"
        lines = subprocess.run([sample, file, str(seed)], capture_output=True, text=True, check=True).stdout.splitlines()
        self.assert_ok(system.run("export", file, "--csv", self.folder / "csv"))
        found = self.exported(self.folder / "csv")
        self.assertEqual(sorted(found), list(range(1, len(lines) + 1)))
        for time, line in enumerate(lines, 1):
            kind, *expected = json.loads(line)
            # In CSV, empty texts and the cells of missing list elements are the same.
            wanted = sorted(same_text(value) for value in expected if value != "")
            got = sorted(same_text(float(text)) if self.is_real(text, wanted) else text for text in found[time] if text)
            self.assertEqual(got, wanted, kind)

    @staticmethod
    def is_real(text, wanted):
        """Whether a cell contains a real number, whose text differs between the writers."""
        if text in wanted:
            return False
        try:
            float(text)
        except ValueError:
            return False
        return True


if __name__ == "__main__":
    system.main()
