#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Numbers in README.md and docs/*.md that a command prints: compares them with the command's output, or writes them; see --help."""

import argparse
import ast
import json
import math
import os
import pathlib
import re
import resource
import shutil
import signal
import string
import subprocess
import sys
import tempfile
import time

import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = "deploy/numbers.yaml"
HELP = f"""\
Takes the numbers of README.md and docs/*.md from the commands that print them. {DATA} lists the commands, the blocks and the
sentences. Without an option the script runs the commands, and writes each number that has changed. A command runs once, however
many numbers it has, and runs from the folder of the sources; $PRESETS is a copy of config/presets that it may change.

A command whose entry has `long: true` (minutes of processor time) runs with --all only; blocks and sentences that use it are
left alone otherwise.

Exit code: 0 all numbers agree, or were written; 1 with --check, a number differs, with file, line, command, found and
expected; 2 a command failed, or an entry of {DATA} does not fit its file.
"""
EXAMPLES = f"""\
examples:
  deploy/renew.py                            run the short commands, write what changed; then read `git diff`
  deploy/renew.py --check                    compare; write nothing
  deploy/renew.py --all                      the long commands, too (some minutes)
  deploy/renew.py --only cooperative.md      numbers of files whose name contains this text
  deploy/renew.py --list                     the commands, and the files that use them

to mark a number, add to {DATA}:
  commands:
    table3: {{run: tandem experiment table3 --offline --json}}
  sentences:
    - file: docs/reproduction.md
      text: "`nspwln` needs {{row(table3.rows, method='nspwln').iterations:.0f}} iterations."
The text between the braces is a Python expression over the outputs of commands (JSON: attributes; else the text), then a colon and
a format. The file contains the sentence with numbers at these places, exactly once; its lines may break anywhere. A sentence starts
and ends with words, so that the places of numbers are certain.

to mark a block, e.g. a table, put these two lines around it in the file:
  <!-- results: made by deploy/renew.py -->
  <!-- end -->
and in {DATA} either `printed: COMMAND` (the output as it is), or `head`, `each` (a list) and `row` (a text as above, where r is
the element of the list), or `text` (one text). `texts` has named texts with a parameter x: {{error(r.epsilon_a)}}.
"""


class Problem(Exception):
    """A command or an entry with an error; the message names it."""


class Record(dict):
    """An object of JSON; its members are attributes."""

    __getattr__ = dict.__getitem__


def rows(lines, **members):
    """Those objects of a list that have these values."""
    return [line for line in lines if all(line.get(key) == value for key, value in members.items())]


def row(lines, **members):
    found = rows(lines, **members)
    if len(found) != 1:
        raise LookupError(f"{len(found)} objects have {members}, expected one")
    return found[0]


def number(text, pattern):
    """The number that the first group of a regular expression finds in a text."""
    found = re.search(pattern, text)
    if not found:
        raise LookupError(f"the output does not contain '{pattern}'")
    return float(found.group(1))


def interval(count, total):
    """Wilson's 95 % interval of a rate, in percent, as text."""
    z, rate = 1.959964, count / total  # normal quantile of 97.5 %
    middle = rate + z * z / (2 * total)
    half = z * math.sqrt(rate * (1 - rate) / total + z * z / (4 * total * total))
    low, high = (100 * (middle + sign * half) / (1 + z * z / total) for sign in (-1, 1))
    return f"{max(low, 0.0):.1f} to {min(high, 100.0):.1f} %"


FUNCTIONS = {f.__name__: f for f in (
    rows, row, number, interval, abs, min, max, sum, len, round,
    sorted, zip, float, int, str, enumerate, range, set, all, any, format)}


class Commands:
    """Runs each command once; stores its output."""

    def __init__(self, entries, binaries):
        self.entries = entries
        self.outputs = {}
        self.seconds = {}
        self.environment = dict(os.environ, PATH=f"{binaries}:{os.environ['PATH']}", LC_ALL="C.UTF-8")

    def line(self, name):
        return self.entries[name]["run"]

    def text(self, name):
        if name not in self.outputs:
            before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
            with tempfile.TemporaryDirectory() as folder:
                presets = shutil.copytree(ROOT / "config/presets", pathlib.Path(folder) / "presets")
                done = subprocess.run(["bash", "-c", self.line(name)], cwd=ROOT, env={**self.environment, "PRESETS": str(presets)},
                                      capture_output=True, text=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            self.seconds[name] = (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.monotonic() - began)
            if done.returncode != self.entries[name].get("exit", 0):
                raise Problem(f"command '{name}' ({self.line(name)}): exit code {done.returncode}, expected "
                              f"{self.entries[name].get('exit', 0)}: {(done.stderr or done.stdout).strip()[-500:]}")
            self.outputs[name] = done.stdout
        return self.outputs[name]

    def value(self, name):
        text = self.text(name)
        return json.loads(text, object_hook=Record) if text.lstrip()[:1] in ("{", "[") else text


def names(expressions):
    """Names that Python expressions read."""
    return {node.id for text in expressions for node in ast.walk(ast.parse(text, mode="eval")) if isinstance(node, ast.Name)}


def parts(text):
    """(literal, expression, format) of a text with expressions in braces; the last expression may be None."""
    return [(literal, None if field is None else field + (f"!{conversion}" if conversion else ""), form)
            for literal, field, form, conversion in string.Formatter().parse(text)]


class Entry:
    """A block or a sentence of numbers.yaml: the commands that it reads, its place in the file, and its expected text."""

    def __init__(self, keys, commands, texts, place):
        self.keys, self.commands, self.place = keys, commands, place
        self.texts = {name: lambda x, text=text: self.filled(text, {"x": x})[1] for name, text in texts.items()}
        self.file = keys["file"]
        unknown = set(keys) - {"file", "name", "text", "printed", "head", "each", "row"}
        if unknown:
            raise Problem(f"{place}: unknown key {', '.join(sorted(unknown))}")
        self.used = sorted(self.reads() & set(commands.entries))

    def reads(self):
        if "printed" in self.keys:
            return {self.keys["printed"]}
        texts = [self.keys[key] for key in ("text", "row") if key in self.keys]
        expressions = [e for text in texts for _, e, _ in parts(text) if e is not None]
        return names(expressions + ([self.keys["each"]] if "each" in self.keys else []))

    def long(self):
        return any(self.commands.entries[name].get("long") for name in self.used)

    def evaluate(self, expression, extra=None):
        scope = {"__builtins__": {**FUNCTIONS, **self.texts}, **{name: self.commands.value(name) for name in self.used}, **(extra or {})}
        try:
            return eval(expression, scope)  # expressions are part of the sources, like this script
        except (LookupError, TypeError, ValueError, ZeroDivisionError, AttributeError, NameError, SyntaxError) as error:
            raise Problem(f"{self.place}: {{{expression}}}: {type(error).__name__}: {error}") from error

    def filled(self, text, extra=None):
        """Values as text, one for each expression, and the whole text."""
        values, whole = [], ""
        for literal, expression, form in parts(text):
            whole += literal
            if expression is not None:
                values.append(self.formatted(expression, form, extra))
                whole += values[-1]
        return values, whole

    def formatted(self, expression, form, extra):
        value = self.evaluate(expression, extra)
        try:
            text = format(value, form)
        except (TypeError, ValueError) as error:
            raise Problem(f"{self.place}: {{{expression}:{form}}}: {error}") from error
        return text[1:] if text.startswith("-") and not text.strip("-0.") else text  # no -0.000


class Sentence(Entry):
    def differences(self, page):
        """(start, end, expected) of each number in the page that differs."""
        pattern, literals = "", parts(self.keys["text"])
        if not literals[0][0].strip() or literals[-1][1] is not None:
            raise Problem(f"{self.place}: the sentence starts or ends with a number; expected words")
        for literal, expression, _ in literals:
            pieces = [re.escape(word) for word in re.split(r"\s+", literal)]
            pattern += r"\s+".join(pieces) + ("" if expression is None else r"([^|]{1,60}?)")
        found = list(re.finditer(pattern, page))
        if len(found) != 1:
            raise Problem(f"{self.place}: {self.file} contains this sentence {len(found)} times, expected once: "
                          f"\"{' '.join(self.keys['text'].split())}\"")
        values, _ = self.filled(self.keys["text"])
        return [(*found[0].span(i + 1), value) for i, value in enumerate(values) if found[0].group(i + 1) != value]


class Block(Entry):
    def differences(self, page):
        """(start, end, expected) of each line in the block that differs; of the rest at once if the number of lines does."""
        begin = f"<!-- {self.keys['name']}: made by deploy/renew.py -->\n"
        if page.count(begin) != 1 or "<!-- end -->" not in page[page.index(begin):]:
            raise Problem(f"{self.place}: {self.file} contains '{begin.strip()}' {page.count(begin)} times, "
                          "expected once, with a line '<!-- end -->' below")
        start = page.index(begin) + len(begin)
        found, expected = page[start:page.index("<!-- end -->", start)], self.expected()
        old, new = found.splitlines(keepends=True), expected.splitlines(keepends=True)
        if len(old) != len(new):
            return [(start, start + len(found), expected)]
        spans, position = [], start
        for was, line in zip(old, new):
            if was != line:
                spans.append((position, position + len(was), line))
            position += len(was)
        return spans

    def expected(self):
        if "printed" in self.keys:
            text = self.commands.text(self.keys["printed"]).rstrip("\n")
            return f"```\n{text}\n```\n"
        if "text" in self.keys:
            return self.filled(self.keys["text"])[1]
        lines = [self.filled(self.keys["row"], {"r": r})[1].rstrip("\n") for r in self.evaluate(self.keys["each"])]
        return "\n".join([self.keys["head"].rstrip("\n"), *lines]) + "\n"


def line_of(page, position):
    return page.count("\n", 0, position) + 1


def read(path, binaries):
    """Commands and entries of numbers.yaml; everything wrong with it in one message."""
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    commands, entries, errors = Commands(data["commands"], binaries), [], []
    for kind, make in (("blocks", Block), ("sentences", Sentence)):
        for i, keys in enumerate(data.get(kind) or []):
            try:
                entries.append(make(keys, commands, data.get("texts") or {}, f"{DATA}: {kind}[{i}]"))
            except (Problem, KeyError, SyntaxError, ValueError) as error:
                errors.append(f"{DATA}: {kind}[{i}]: {type(error).__name__}: {error}")
    if errors:
        raise Problem("\n".join(errors))
    return commands, entries


def renew(root, entries, check):
    """Compares or writes each entry; the numbers that differ, and the errors, as messages."""
    differing, errors = [], []
    for entry in entries:
        path = root / entry.file
        page = path.read_text(encoding="utf-8")
        try:
            spans = entry.differences(page)
        except Problem as problem:
            errors.append(str(problem))
            continue
        for start, end, expected in spans:
            by = "; ".join(entry.commands.line(name) for name in entry.used)
            differing.append(f"{entry.file}:{line_of(page, start)}: found \"{page[start:end].strip()}\", expected \"{expected.strip()}\" "
                             f"({by})")
        if spans and not check:
            for start, end, expected in reversed(spans):
                page = page[:start] + expected + page[end:]
            path.write_text(page, encoding="utf-8")
    return differing, errors


def main(arguments=None):
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    parser = argparse.ArgumentParser(formatter_class=argparse.RawDescriptionHelpFormatter, description=HELP, epilog=EXAMPLES)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    parser.add_argument("--all", action="store_true", help="long commands, too")
    parser.add_argument("--only", default="", metavar="TEXT", help="only files whose name contains TEXT")
    parser.add_argument("--list", action="store_true", help="print commands and the files that use them, run nothing")
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin", metavar="FOLDER",
                        help="folder of the program tandem (build/release/bin)")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, metavar="FOLDER", help="folder of README.md and docs (the sources)")
    options = parser.parse_args(arguments)
    try:
        commands, entries = read(options.root / DATA, options.bin.resolve())
        entries = [e for e in entries if options.only in e.file and (options.all or options.list or not e.long())]
        if options.list:
            for name, keys in commands.entries.items():
                users = sorted({e.file for e in entries if name in e.used})
                print(f"{name}{' (long)' if keys.get('long') else ''}: {keys['run']}\n    {', '.join(users) or 'not used'}")
            return 0
        differing, errors = renew(options.root, entries, options.check)
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 2
    for message in [*differing, *errors]:
        print(message, file=sys.stderr if options.check or errors else sys.stdout)
    for name, (processor, wall) in sorted(commands.seconds.items(), key=lambda item: -item[1][0]):
        print(f"{processor:7.1f} s of processor time, {wall:7.1f} s: {commands.line(name)}")
    print(f"{len(entries)} blocks and sentences, {len(differing)} numbers or lines {'differ' if options.check else 'written'}, "
          f"{len(commands.seconds)} commands, {sum(s for s, _ in commands.seconds.values()):.0f} s of processor time, "
          f"{sum(w for _, w in commands.seconds.values()):.0f} s")
    return 2 if errors else int(options.check and bool(differing))


if __name__ == "__main__":
    sys.exit(main())
