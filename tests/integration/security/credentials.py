# SPDX-License-Identifier: Apache-2.0
"""A certificate authority and its credentials, for tests."""
import datetime
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402


def day(ago):
    """Date `ago` days ago."""
    return (datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(days=ago)).strftime("%Y-%m-%d")


class Authority:
    """`tandem security init` in a folder, and credentials for a prefix and a domain."""

    def __init__(self, folder, prefix="tandem", domain=0):
        self.folder, self.prefix, self.domain = pathlib.Path(folder), prefix, domain
        self.run("init", self.folder, "--from", day(60))

    def run(self, *words):
        answer = system.run("security", *words)
        if answer.returncode != 0:
            raise AssertionError(f"tandem security {words}: {answer.stdout}{answer.stderr}")
        return answer.stdout

    def issue(self, *roles, prefix=None, **options):
        words = [word for key, value in options.items() for word in (f"--{key}", value)]
        self.run("issue", self.folder, *roles, "--prefix", prefix or self.prefix, "--domain", self.domain, *words)
        return pathlib.Path(options.get("to", self.folder))
