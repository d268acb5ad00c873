# SPDX-License-Identifier: Apache-2.0
"""Libraries linked into the programs of a robot, according to build.ninja: no simulator, no experiments.

    links_test.py BUILD/build.ninja"""

import pathlib
import re
import sys

APART = {"tandem_sim", "tandem_simulation", "tandem_experiments"}
WITHOUT = ["tandem-hal", "tandem-discovery", "tandem-recorder"]
WITH = ["tandem-sim", "tandem"]  # detects a build.ninja in another format


def linked(rules, program):
    """Libraries of this project that a program is linked with."""
    line = re.search(rf"^build bin/{program}: .*$", rules, re.MULTILINE)
    return set(re.findall(r"/lib(tandem\w*)\.a\b", line.group(0))) if line else set()


def main():
    rules = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    found = [f"{program} is linked with {library}" for program in WITHOUT
             for library in sorted(linked(rules, program) & APART)]
    found += [f"{program}: found no {' or '.join(sorted(APART))}, this check looks in the wrong place"
              for program in WITH if not linked(rules, program) & APART]
    found += [f"{program}: found no library of ours" for program in WITHOUT if not linked(rules, program)]
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
