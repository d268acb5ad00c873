# SPDX-License-Identifier: Apache-2.0
"""Pages that are logs of their commands: docs/PAGE.md is what docs/PAGE.sh prints. Blocks marked `varies` are from real-time runs: their
numbers are not compared, nor which limits restricted the motion.

walk_test.py BIN PYTHON PAGE compares; with --write it writes the page and its pictures."""
import difflib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "integration" / "harness"))
import system  # noqa: E402

NAME = sys.argv[3]
PAGE = ROOT / "docs" / f"{NAME}.md"
PICTURE = re.compile(rf"!\[.*\]\(images/{NAME}-(\S+)\.png\)")


def walk(folder):
    """The page that a run prints; its files are in folder/walk."""
    python = folder / "python3"  # the interpreter of this test, which has numpy
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    environment = {**os.environ, "PATH": f"{folder}:{sys.argv[1]}:{os.environ['PATH']}", "PYTHONPATH": sys.argv[2],
                   "TANDEM_DOMAIN": str(system.free_domain()), "XDG_STATE_HOME": str(folder)}
    done = subprocess.run([ROOT / "docs" / f"{NAME}.sh", folder / "walk"], env=environment, text=True, stdout=subprocess.PIPE, timeout=400)
    if done.returncode != 0:
        raise SystemExit(f"{done.stdout}\n{NAME}.sh: exit code {done.returncode}")
    return done.stdout


def comparable(page):
    """Lines of a page, without what varies from run to run."""
    varies, lines = False, []
    for line in page.splitlines():
        if line.startswith("```"):
            varies = line.endswith(" varies")
        if varies and "restricted the motion" in line:
            continue
        if varies and not line.startswith("$ "):
            line = re.sub(r"-?\d+(\.\d+)?(e-\d+)?", "#", line)
            line = re.sub(r"guards: fresh #$", "guards: none", line)  # the first command may come before the first state
        lines.append(re.sub(r"-?\d+\.\d{9,}", lambda digits: f"{float(digits[0]):.8g}", line))  # the last digits depend on the processor
    return lines


def main():
    with tempfile.TemporaryDirectory(prefix="tandem-walk-") as folder:
        folder = pathlib.Path(folder)
        page = walk(folder)
        pictures = {name: folder / "walk" / f"{name}.png" for name in PICTURE.findall(page)}
        for name, picture in pictures.items():
            assert picture.stat().st_size > 5000, f"{name}.png is empty"
            assert (ROOT / "docs" / "images" / f"{NAME}-{name}.png").is_file() or "--write" in sys.argv, f"{NAME}-{name}.png is missing"
        if "--write" in sys.argv:
            PAGE.write_text(page)
            for name, picture in pictures.items():
                shutil.copy(picture, ROOT / "docs" / "images" / f"{NAME}-{name}.png")
            return
    differences = list(difflib.unified_diff(comparable(PAGE.read_text()), comparable(page), PAGE.name, "this run", lineterm=""))
    if differences:
        raise SystemExit("\n".join(differences) + f"\nto write the page: {' '.join(sys.argv)} --write")
    print(f"{len(page.splitlines())} lines and {len(pictures)} pictures as in docs/{PAGE.name}")


main()
