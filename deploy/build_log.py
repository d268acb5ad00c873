# SPDX-License-Identifier: Apache-2.0
"""Evaluation of ninja's log: seconds by target, slowest objects, slowest links. For build_times.py."""

import collections
import pathlib
import re

TOP = 20
QUICK = 0.1  # seconds; hardly a C++ source compiles in less, ccache copies an object in less

# One run of a rule of build.ninja: kind is `compile`, `link` or `other`.
Run = collections.namedtuple("Run", "output kind target seconds")


class Problem(Exception):
    """An error that the user can correct; the text names the correction."""


def how_to_build(preset):
    if preset == "release":
        return "deploy/run.sh --build-only"
    return f"cmake --preset {preset} && cmake --build --preset {preset}"


def cold_build(preset):
    return (f"  cmake --build --preset {preset} --target clean\n"
            f"  CCACHE_DISABLE=1 cmake --build --preset {preset}")


def read(path, preset):
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise Problem(f"{path}: {error.strerror}. Build first: {how_to_build(preset)}") from None
    except UnicodeDecodeError:
        raise Problem(f"{path}: not a text. Remove it and build again: {how_to_build(preset)}") from None


def log_entry(line):
    """(output, (start, end, hash)) of a line, None if it is malformed."""
    fields = line.split("\t")
    if len(fields) != 5 or not (fields[0].isdigit() and fields[1].isdigit()):
        return None
    return fields[3], (int(fields[0]), int(fields[1]), fields[4])


def read_log(path, preset):
    """Output -> (start ms, end ms, hash), the newest entry of each."""
    text = read(path, preset)
    head, _, body = text.partition("\n")
    again = f"Remove it and make a cold build:\n{cold_build(preset)}"
    if not re.fullmatch(r"# ninja log v[567]", head):
        raise Problem(f"{path}: not a log of ninja, version 5 to 7. {again}")
    complete = body[:body.rfind("\n") + 1]  # a killed ninja leaves an incomplete line
    entries = {}
    for number, line in enumerate(complete.splitlines(), 2):
        entry = log_entry(line)
        if entry is None:
            raise Problem(f"{path}:{number}: broken line. {again}")
        entries[entry[0]] = entry[1]
    if not entries:
        raise Problem(f"{path}: nothing has been built. Build first: {how_to_build(preset)}")
    return entries


def read_rules(text):
    """Output -> (name of its rule, the rule's first output), from the text of build.ninja."""
    rules = {}
    for line in text.splitlines():
        match = re.match(r"build ((?:[^:$]|\$.)+): (\S+)", line)
        if not match:
            continue
        outputs = [re.sub(r"\$([ :$])", r"\1", name) for name in re.split(r"(?<!\$) (?:\| )?", match.group(1))]
        rules.update(dict.fromkeys(outputs, (match.group(2), outputs[0])))
    return rules


def kind_and_target(output, rule):
    """Kind of a rule, and its target."""
    if "_COMPILER__" in rule:
        match = re.search(r"CMakeFiles/(.+?)\.dir/", output)
        return "compile", match.group(1) if match else output
    match = re.search(r"_LINKER__(.+)_[^_]*$", rule)
    return ("link", match.group(1)) if match else ("other", "")


def runs_of(entries, rules):
    """A Run for each rule that is still in build.ninja; several outputs of one rule count once."""
    runs = {}
    for output, (start, end, digest) in entries.items():
        if output in rules:
            rule, first = rules[output]
            runs.setdefault((start, end, digest), Run(first, *kind_and_target(first, rule), (end - start) / 1000))
    return list(runs.values())


def of_kind(runs, kind):
    """The runs of a kind, the slowest first."""
    return sorted((run for run in runs if run.kind == kind), key=lambda run: (-run.seconds, run.output))


def seconds_of(runs):
    return sum(run.seconds for run in runs)


def by_target(runs):
    """(target, seconds of compilations, seconds of links, objects), the most expensive first."""
    rows = {}
    for run in runs:
        if run.kind != "other":
            row = rows.setdefault(run.target, [0.0, 0.0, 0])
            row[0 if run.kind == "compile" else 1] += run.seconds
            row[2] += run.kind == "compile"
    return sorted(((target, *row) for target, row in rows.items()), key=lambda row: (-row[1] - row[2], row[0]))


def note_of_cache(compilations, preset):
    """Note for the user if more than a tenth of the C++ objects came from ccache, else empty; a Problem if most did."""
    objects = [run for run in compilations if not run.output.endswith(".c.o")]
    hits = sum(run.seconds < QUICK for run in objects)
    text = (f"{hits} of {len(objects)} C++ objects took under {QUICK} s: they came from ccache, and their times say nothing. "
            f"A cold build:\n{cold_build(preset)}")
    if hits * 2 > len(objects):
        raise Problem(text)
    return text if hits * 10 > len(objects) else ""


def sources_in(source):
    """The sources compiled in a file: those that a unity file includes, or the file itself."""
    if not re.fullmatch(r"unity_\d+_\w+\.\w+", source.name):
        return [source]
    return [pathlib.Path(name) for name in re.findall(r'^#include "(.+)"', source.read_text(encoding="utf-8"), re.MULTILINE)]


def print_times(build, preset):
    runs = runs_of(read_log(build / ".ninja_log", preset), read_rules(read(build / "build.ninja", preset)))
    compilations, links, others = (of_kind(runs, kind) for kind in ("compile", "link", "other"))
    note = note_of_cache(compilations, preset)
    print(f"Preset {preset}: seconds by the clock, each the newest in ninja's log\n")
    for name, some in (("compilations", compilations), ("links", links), ("all else", others)):
        print(f"{seconds_of(some):9.1f} s  {len(some):4} {name}")
    print("\nBy target\n  compile     link  objects")
    targets = by_target(runs)
    dear = [row for row in targets if row[1] + row[2] >= 1]
    for target, compiling, linking, count in dear:
        print(f"{compiling:9.1f}{linking:9.1f}{count:9}  {target}")
    print(f"    and {len(targets) - len(dear)} targets under a second each")
    print(f"\nSlowest {TOP} objects")
    for run in compilations[:TOP]:
        print(f"{run.seconds:9.1f}  {run.output}")
        source = build / run.output.removesuffix(".o")
        if "/Unity/" in run.output and source.is_file():
            print(" " * 13 + " ".join(part.name for part in sources_in(source)))
    print(f"\nSlowest {TOP} links, with what runs after them (a test program lists its tests)")
    for run in links[:TOP]:
        print(f"{run.seconds:9.1f}  {run.output}")
    if note:
        print(f"\n{note}")
