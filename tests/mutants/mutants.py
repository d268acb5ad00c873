#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutants: one-line changes of the code, each of which has to make a test of its hazard fail. deploy/mutants.sh runs all of it.

  mutants.py --apply TREE             writes all mutants into a copy of the sources: TANDEM_MUTANT=NUMBER selects one of them at run time
  mutants.py --run BUILD --results FILE [--shard i/n] [--seed N] [--processes]
                                      runs the tests of each mutant's hazard until one fails; FILE has a line for each mutant, and those
                                      that it has already are left out
  mutants.py --write PAGE FILE...     writes the page for people from the results
  mutants.py --check PAGE             whether the page has every mutant, killed by a test of its hazard or alive with a reason"""
import argparse
import collections
import fnmatch
import json
import os
import pathlib
import random
import re
import subprocess
import sys

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "hazards"))
import trace as hazards  # noqa: E402  (the one in that folder)

SOURCE = pathlib.Path(__file__).with_name("mutants.yaml")
KEYS = {"name", "hazard", "file", "of", "to"}
HEADER = "tests/mutants/selected.h"
SELECTED = """\
#pragma once
#include <cstdlib>
#include <type_traits>
namespace tandem_mutants {
inline const int selected = std::getenv("TANDEM_MUTANT") ? std::atoi(std::getenv("TANDEM_MUTANT")) : 0;
constexpr bool on(int number) { return !std::is_constant_evaluated() && selected == number; }
}  // namespace tandem_mutants
"""


def load(path=SOURCE):
    """The mutants with their numbers, from 1; SystemExit names what is wrong with the file, or which anchor is gone."""
    known = {hazard["id"] for hazard in hazards.load()}
    mutants, names = yaml.safe_load(path.read_text())["mutants"], set()
    for number, mutant in enumerate(mutants, 1):
        name = mutant.get("name", f"mutant {number}")
        if set(mutant) - {"alive"} != KEYS:
            sys.exit(f"{path}: {name}: found the keys {sorted(mutant)}, expected {sorted(KEYS)}, and alive")
        if name in names:
            sys.exit(f"{path}: {name}: found a second time, expected another name")
        if mutant["hazard"] not in known:
            sys.exit(f"{path}: {name}: hazard: found {mutant['hazard']}, expected one of hazards.yaml")
        found = (ROOT / mutant["file"]).read_text().count(mutant["of"])
        if found != 1:
            sys.exit(f"{path}: {name}: of: found {found} times in {mutant['file']}, expected once: {mutant['of']}")
        names.add(name)
        mutant["number"] = number
    return mutants


def choice(mutants):
    """The text that stands for all mutants of one place."""
    of = mutants[0]["of"]
    if of.endswith(";"):
        text = "{ " + of + " }"
        for mutant in mutants:
            text = f"{{ if (::tandem_mutants::on({mutant['number']})) {{ {mutant['to']} }} else {text} }}"
        return text
    condition = re.fullmatch(r"if \((.*)\)", of, re.DOTALL)
    inner = condition[1] if condition else of
    text = f"({inner})"
    for mutant in mutants:
        to = re.fullmatch(r"if \((.*)\)", mutant["to"], re.DOTALL)[1] if condition else mutant["to"]
        text = f"(::tandem_mutants::on({mutant['number']}) ? ({to}) : {text})"
    return f"if ({text})" if condition else text


def mutated(name, places):
    """A file with the mutants of all its places. @param places  text -> mutants"""
    text, end, parts = (ROOT / name).read_text(), 0, [f'#include "{HEADER}"\n']
    for at, of in sorted((text.index(of), of) for of in places):
        if at < end:
            sys.exit(f"{name}: two mutants overlap, expected equal or separate places: {of}")
        parts += [text[end:at], choice(places[of])]
        end = at + len(of)
    return "".join(parts) + text[end:]


def apply(tree):
    """Makes a folder a copy of the sources with all mutants. Files that stay the same keep their times: a build compiles the others."""
    places = collections.defaultdict(lambda: collections.defaultdict(list))
    for mutant in load():
        places[mutant["file"]][mutant["of"]].append(mutant)
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    contents = {name: mutated(name, places[name]).encode() if name in places else (ROOT / name).read_bytes()
                for name in listed.splitlines() if (ROOT / name).is_file()} | {HEADER: SELECTED.encode()}
    for name, content in contents.items():
        path = tree / name
        if not path.exists() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            if (ROOT / name).exists():
                path.chmod((ROOT / name).stat().st_mode)
    for path in tree.rglob("*"):
        name = path.relative_to(tree)
        if path.is_file() and name.parts[0] != "build" and str(name) not in contents:
            path.unlink()


def tests_of(build):
    """name -> labels, of all tests of a build folder."""
    listed = subprocess.run(["ctest", "--show-only=json-v1"], cwd=build, check=True, capture_output=True, text=True).stdout
    properties = {test["name"]: {p["name"]: p["value"] for p in test.get("properties", [])} for test in json.loads(listed)["tests"]}
    return {name: of.get("LABELS", []) for name, of in properties.items()}


def failing(build, names, number):
    """The first of the tests that fails; None if all pass."""
    if not names:
        return None
    pattern = "^(" + "|".join(map(re.escape, names)) + ")$"
    words = ["ctest", "--stop-on-failure", "-j", str(os.cpu_count()), "-R", pattern]
    environment = {**os.environ, "TANDEM_MUTANT": str(number)}
    answer = subprocess.run(words, cwd=build, text=True, capture_output=True, env=environment)
    failed = re.findall(r"Test\s+#\d+: (.+?) \.+\s*\*\*\*(?:Failed|Timeout|Exception|Not Run)", answer.stdout)
    ours = [name for name in failed if name in names]
    if answer.returncode != 0 and not ours:
        sys.exit(f"ctest failed without one of the tests:\n{answer.stdout[-2000:]}{answer.stderr[-2000:]}")
    return ours[0].split("  # ")[0] if ours else None  # without the value of its parameter


def candidates(hazard, labels, processes):
    """Tests of a hazard that may kill a mutant, quick ones first: unit tests, then those with processes, if asked for."""
    names = {name for pattern in hazard["tests"] for name in fnmatch.filter(labels, pattern)}
    if not names:
        sys.exit(f"this build has no test of {hazard['id']}: found none of {', '.join(hazard['tests'])}")
    unit = sorted(name for name in names if "unit" in labels[name])
    others = sorted(name for name in names if not {"unit", "long"} & set(labels[name]))
    return [unit, *([name] for name in others if processes)]


def killer(build, hazard, labels, number, processes):
    return next((found for names in candidates(hazard, labels, processes) if (found := failing(build, names, number))), None)


def run(options):
    labels, known = tests_of(options.run), {hazard["id"]: hazard for hazard in hazards.load()}
    results, index, count = options.into, *map(int, options.shard.split("/"))
    mutants = load()
    random.Random(options.seed).shuffle(mutants)
    done = {line["name"] for line in lines([results])} if results.exists() else set()
    todo = [mutant for mutant in mutants[index::count] if mutant["name"] not in done]
    for hazard in sorted({mutant["hazard"] for mutant in todo}):
        if broken := killer(options.run, known[hazard], labels, 0, options.processes):
            sys.exit(f"{broken} of {hazard} fails without any mutant")
    for at, mutant in enumerate(todo, 1):
        processes = options.processes and "alive" not in mutant
        found = killer(options.run, known[mutant["hazard"]], labels, mutant["number"], processes)
        with results.open("a") as file:
            file.write(json.dumps({"name": mutant["name"], "of": mutant["of"], "to": mutant["to"], "killed": found}) + "\n")
        print(f"{at}/{len(todo)} {mutant['hazard']} {mutant['name']}: {'killed by ' + found if found else 'ALIVE'}", flush=True)


def lines(files):
    return [json.loads(line) for file in files for line in file.read_text().splitlines()]


def page(mutants, killed):
    """@param killed  name -> test, or None"""
    text = [
        "# Mutants",
        "",
        "<!-- Written by tests/mutants/mutants.py --write from tests/mutants/mutants.yaml and the results of deploy/mutants.sh. -->",
        "",
        f"{len(mutants)} one-line changes that break a control of a [hazard](hazards.md). The last column names the test of that hazard",
        "that fails with the change, or the reason why no test fails. `deploy/mutants.sh` builds all mutants into one set of programs,",
        "selects one at a time, and runs the tests of its hazard until one fails. A mutant whose code no longer exists is an error of",
        "the test `mutants_list`.",
        "",
        "| hazard | mutant | file | code | mutated | killed by |",
        "|---|---|---|---|---|---|",
    ]
    for mutant in sorted(mutants, key=lambda m: (m["hazard"], m["number"])):
        code, to = ("`" + " ".join(mutant[key].split()).replace("|", "\\|") + "`" for key in ("of", "to"))
        test = killed.get(mutant["name"])
        verdict = f"`{test}`" if test else f"none: {mutant['alive']}"
        to = "removed" if to == "`;`" else to
        text.append(f"| {mutant['hazard']} | {mutant['name']} | {mutant['file']} | {code} | {to} | {verdict} |")
    return "\n".join(text) + "\n"


def written(path):
    """name -> test, of a page."""
    rows = [re.split(r"(?<!\\)\|", line) for line in path.read_text().splitlines() if re.match(r"\| H\d", line)]
    return {row[2].strip(): row[-2].strip().strip("`") for row in rows if row[-2].strip().startswith("`")}


def check(path):
    """SystemExit where the page is not that of the mutants, or a test that killed one is not of its hazard."""
    mutants, killed, known = load(), written(path), {hazard["id"]: hazard for hazard in hazards.load()}
    for mutant in mutants:
        test = killed.get(mutant["name"])
        if test is None and "alive" not in mutant:
            sys.exit(f"{path}: {mutant['name']}: killed by no test; run deploy/mutants.sh, then write a test, or give the reason (alive)")
        if test is not None and not any(fnmatch.fnmatch(test, pattern) for pattern in known[mutant["hazard"]]["tests"]):
            sys.exit(f"{path}: {mutant['name']}: {test} is not a test of {mutant['hazard']}")
    if path.read_text() != page(mutants, killed):
        sys.exit(f"{path} is not what {SOURCE} says; run deploy/mutants.sh")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--apply", metavar="TREE", type=pathlib.Path)
    what.add_argument("--run", metavar="BUILD", type=pathlib.Path)
    what.add_argument("--write", metavar="PAGE", type=pathlib.Path)
    what.add_argument("--check", metavar="PAGE", type=pathlib.Path)
    parser.add_argument("results", nargs="*", type=pathlib.Path)
    parser.add_argument("--results", dest="into", metavar="FILE", type=pathlib.Path)
    parser.add_argument("--shard", default="0/1")
    parser.add_argument("--seed", type=int, default=1, help="order of the mutants")
    parser.add_argument("--processes", action="store_true", help="also tests that start processes, for mutants that pass the unit tests")
    options = parser.parse_args()
    if options.run:
        return run(options)
    if options.apply:
        return apply(options.apply)
    if options.check:
        return check(options.check)
    mutants = load()
    current = {(mutant["name"], mutant["of"], mutant["to"]) for mutant in mutants}
    killed = written(options.write) if options.write.exists() else {}
    killed |= {line["name"]: line["killed"] for line in lines(options.results) if (line["name"], line["of"], line["to"]) in current}
    alive = [mutant["name"] for mutant in mutants if not killed.get(mutant["name"]) and "alive" not in mutant]
    if alive:
        sys.exit("alive without a reason:\n  " + "\n  ".join(alive))
    options.write.write_text(page(mutants, killed))


if __name__ == "__main__":
    main()
