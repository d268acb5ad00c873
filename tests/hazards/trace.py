#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Hazards against the tests that show their controls.

  trace.py --results FILE...   compares hazards.yaml with JUnit files of ctest: names each hazard without a passing test, or with
                               one that failed or did not run; the exit code is then 1
  trace.py --names FILE        only whether each pattern names a test; FILE has one name a line
  trace.py --write PAGE        writes the page for people
  trace.py --check PAGE        whether the page is the one that would be written"""
import argparse
import collections
import fnmatch
import pathlib
import sys
import xml.etree.ElementTree

import yaml

SOURCE = pathlib.Path(__file__).parent / "hazards.yaml"
MUTANTS = pathlib.Path(__file__).parents[1] / "mutants" / "mutants.yaml"
KEYS = {"id", "hazard", "cause", "severity", "control", "tests"}


def load(path=SOURCE):
    """The hazards; SystemExit names what is wrong with the file."""
    hazards = yaml.safe_load(path.read_text())["hazards"]
    seen = set()
    for hazard in hazards:
        name = hazard.get("id", "a hazard without id")
        if set(hazard) != KEYS:
            sys.exit(f"{path}: {name}: found the keys {sorted(hazard)}, expected {sorted(KEYS)}")
        if name in seen:
            sys.exit(f"{path}: {name}: found a second time, expected another id")
        if hazard["severity"] not in range(1, 6):
            sys.exit(f"{path}: {name}: severity: found {hazard['severity']}, expected 1 to 5")
        if not hazard["tests"]:
            sys.exit(f"{path}: {name}: tests: found none, expected at least one")
        seen.add(name)
    return hazards


def outcomes(paths):
    """name -> "passed", "failed" or "skipped", of JUnit files that ctest wrote."""
    found = {}
    for path in paths:
        for case in xml.etree.ElementTree.parse(path).getroot().iter("testcase"):
            status = case.get("status")
            if status in ("run", None):
                word = "failed" if case.find("failure") is not None else "passed"
            else:
                word = "failed" if status == "fail" else "skipped"
            found[case.get("name")] = word
    return found


def judge(hazards, found):
    """What speaks against each hazard's control, a line each."""
    wrong = []
    for hazard in hazards:
        for pattern in hazard["tests"]:
            names = fnmatch.filter(found, pattern)
            if not names:
                wrong.append(f"{hazard['id']} ({hazard['hazard']}): no test is called {pattern}")
            wrong += [f"{hazard['id']} ({hazard['hazard']}): {name} {found[name]}" for name in names if found[name] != "passed"]
    return wrong


def mutants():
    """id of a hazard -> how many mutants break its control."""
    return collections.Counter(m["hazard"] for m in yaml.safe_load(MUTANTS.read_text())["mutants"])


def page(hazards):
    broken_by = mutants()
    lines = [
        "# Hazards",
        "",
        "<!-- Written by tests/hazards/trace.py --write from tests/hazards/hazards.yaml. -->",
        "",
        "> **Not for clinical use.** This list serves those who develop the software and those who build research robots with it. It",
        "> is not a risk management file: it considers no patient, no intended use and no particular hardware.",
        "",
        "Hazards of the software and its interfaces, their risk controls, and the tests that show the controls. A complete run of",
        "`deploy/test.sh` fails if a test of this list did not run or did not pass.",
        "Severity is the conceivable harm if such a robot were used on people, from 1 (nuisance) to 5 (death or lasting harm).",
        "Budgets and reactions, fault by fault, are in [safety.md](safety.md).",
        "",
        "The last column counts mutants: changes of the code that break the control and make a test fail ([mutants.md](mutants.md)).",
        "",
        "| id | hazard | cause | severity | control | shown by | mutants |",
        "|---|---|---|---|---|---|---|",
    ]
    for h in hazards:
        tests = ", ".join(f"`{name}`" for name in h["tests"])
        lines.append(f"| {h['id']} | {h['hazard']} | {h['cause']} | {h['severity']} | {h['control']} | {tests} | {broken_by[h['id']]} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--results", nargs="+", metavar="FILE")
    what.add_argument("--names", metavar="FILE", type=argparse.FileType())
    what.add_argument("--write", metavar="PAGE", type=pathlib.Path)
    what.add_argument("--check", metavar="PAGE", type=pathlib.Path)
    options = parser.parse_args()
    hazards = load()
    if options.write:
        options.write.write_text(page(hazards))
        return
    if options.check:
        if options.check.read_text() != page(hazards):
            sys.exit(f"{options.check} is not what {SOURCE} says; write it with {__file__} --write {options.check}")
        return
    found = outcomes(options.results) if options.results else {line.strip(): "passed" for line in options.names}
    wrong = judge(hazards, found)
    if wrong:
        sys.exit("hazards whose controls are not shown:\n  " + "\n  ".join(wrong))
    print(f"{len(hazards)} hazards, all shown by tests that passed")


if __name__ == "__main__":
    main()
