# SPDX-License-Identifier: Apache-2.0
"""docs/tutorial.sh walks from a robot file to figures, and docs/tutorial.md is what it prints. Blocks marked `varies` are from real-time
runs: their numbers are not compared, nor which limits restricted the motion.

tutorial_test.py BIN PYTHON compares; tutorial_test.py BIN PYTHON --write writes the page and its pictures."""
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

PAGE = ROOT / "docs" / "tutorial.md"
PICTURE = re.compile(r"!\[.*\]\(images/tutorial-(\S+)\.png\)")


def walk(folder):
    """The page that a run prints; its files are in folder/walk."""
    python = folder / "python3"  # the interpreter of this test, which has numpy
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    environment = {**os.environ, "PATH": f"{folder}:{sys.argv[1]}:{os.environ['PATH']}", "PYTHONPATH": sys.argv[2],
                   "TANDEM_DOMAIN": str(system.free_domain()), "XDG_STATE_HOME": str(folder)}
    done = subprocess.run([ROOT / "docs" / "tutorial.sh", folder / "walk"], env=environment, text=True, stdout=subprocess.PIPE, timeout=400)
    if done.returncode != 0:
        raise SystemExit(f"{done.stdout}\ntutorial.sh: exit code {done.returncode}")
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
    with tempfile.TemporaryDirectory(prefix="tandem-tutorial-") as folder:
        folder = pathlib.Path(folder)
        page = walk(folder)
        pictures = {name: folder / "walk" / f"{name}.png" for name in PICTURE.findall(page)}
        for name, picture in pictures.items():
            assert picture.stat().st_size > 5000, f"{name}.png is empty"
            assert (ROOT / "docs" / "images" / f"tutorial-{name}.png").is_file() or "--write" in sys.argv, f"tutorial-{name}.png is missing"
        if "--write" in sys.argv:
            PAGE.write_text(page)
            for name, picture in pictures.items():
                shutil.copy(picture, ROOT / "docs" / "images" / f"tutorial-{name}.png")
            return
    differences = list(difflib.unified_diff(comparable(PAGE.read_text()), comparable(page), "docs/tutorial.md", "this run", lineterm=""))
    if differences:
        raise SystemExit("\n".join(differences) + f"\nto write the page: {' '.join(sys.argv)} --write")
    print(f"{len(page.splitlines())} lines and {len(pictures)} pictures as in docs/tutorial.md")


main()
