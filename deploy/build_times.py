# SPDX-License-Identifier: Apache-2.0
"""Report of build times, and a check that the cost of compilation has not doubled; run as deploy/build-times.sh."""

import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import resource
import shlex
import signal
import statistics
import subprocess
import sys
import tempfile
import zlib

from build_log import TOP, Problem, how_to_build, print_times, read, sources_in

ROOT = pathlib.Path(__file__).resolve().parent.parent
RECORD = ROOT / "deploy/build-times.json"
LIMIT = 2.0  # times the recorded value
SAMPLE = 9  # objects
BETWEEN = 3  # objects between two runs of the yardstick
LAUNCHERS = {"ccache", "sccache", "distcc"}
NOT_PRODUCT = {"tests", "bench", "python", "idl"}
SOURCES = {".c", ".cc", ".cpp", ".cxx"}

HELP = """\
Reports where the time of a build goes: seconds of compilations and links, by target, the slowest objects (and the sources
that are compiled together in them), the slowest links, and the cost of each header, summed over all objects. Times are
from ninja's log, by the clock; several compilations at a time make each of them slower. Headers are counted in lines that
the compiler reads of them, by running its preprocessor on every object, which takes half a minute.

--check compiles nine objects of the product, one by one, and a fixed yardstick in between, and fails if the processor
time for a thousand lines is more than twice the value in deploy/build-times.json. It counts in
yardsticks, not in seconds, so that a slow or busy machine makes no difference. It needs a built tree, no log, and
takes a minute.
"""
EXAMPLES = """\
examples:
  deploy/build-times.sh                      the whole report
  deploy/build-times.sh --no-headers         without headers (fast)
  deploy/build-times.sh --preset debug       another preset
  deploy/build-times.sh --check              check the cost of compilation
  deploy/build-times.sh --record             record a new value after an intended increase

Times of a build with objects from ccache are meaningless. A build without it:
  cmake --build --preset release --target clean
  CCACHE_DISABLE=1 cmake --build --preset release
"""

YARDSTICK = """\
#include <Eigen/Dense>
#include <functional>
#include <map>
#include <string>
#include <vector>

double yardstick(const std::map<std::string, std::vector<double>>& columns, const std::function<double(double)>& f) {
  double sum = 0.0;
  for (const auto& [name, values] : columns) {
    for (const double value : values) sum += f(value) + static_cast<double>(name.size());
  }
  const Eigen::MatrixXd a = Eigen::MatrixXd::Constant(6, 6, sum) + Eigen::MatrixXd::Identity(6, 6);
  const Eigen::VectorXd b = Eigen::VectorXd::Ones(6);
  return b.dot(a.ldlt().solve(b)) + b.dot(a.partialPivLu().solve(b));
}
"""

# An object of compile_commands.json; the command has no launcher, no -c and no -o.
Object = collections.namedtuple("Object", "output source command directory")


def progress(text=""):
    """One line on a terminal that the next call overwrites."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\033[K" + text)
        sys.stderr.flush()


# ---- headers


def bare(arguments):
    """(command, output): a compiler's command without launcher, -c, -o and dependency options."""
    while pathlib.PurePath(arguments[0]).name in LAUNCHERS:
        arguments = arguments[1:]
    command, output, rest = [], "", iter(arguments)
    for argument in rest:
        if argument == "-o":
            output = next(rest, "")
        elif argument in ("-MF", "-MT", "-MQ"):
            next(rest, "")
        elif argument not in ("-c", "-MD", "-MMD"):
            command.append(argument)
    return command, output


def read_objects(path, preset):
    """The objects of compile_commands.json, sorted by name."""
    try:
        entries = json.loads(read(path, preset))
        objects = []
        for entry in entries:
            command, output = bare(entry.get("arguments") or shlex.split(entry["command"]))
            source = pathlib.Path(entry["directory"], entry["file"])
            objects.append(Object(output, source, command, entry["directory"]))
    except (ValueError, KeyError, AttributeError, IndexError):
        raise Problem(f"{path}: not what cmake writes. Configure again: cmake --preset {preset}") from None
    return sorted(objects)


def run_compiler(command, directory, what, preset):
    """Standard output of a compiler that must succeed."""
    done = subprocess.run(command, cwd=directory, capture_output=True, check=False, env={**os.environ, "CCACHE_DISABLE": "1"})
    if done.returncode:
        last = "\n".join(done.stderr.decode(errors="replace").splitlines()[:5])
        raise Problem(f"{what}: does not compile. Are all headers generated? Build first: {how_to_build(preset)}\n{last}")
    return done.stdout


def lines_by_file(text):
    """(own, inclusive): non-empty lines of each file in a preprocessed source, and of each file with its includes."""
    own, inclusive, stack, position = collections.Counter(), collections.Counter(), [""], 0
    markers = re.finditer(rb'^# \d+ "((?:[^"\\\n]|\\.)*)"([ \d]*)$', text, re.MULTILINE)
    for match in [*markers, None]:
        region = text[position:match.start() if match else len(text)]
        count = sum(1 for line in region.split(b"\n") if line.strip())
        own[stack[-1]] += count
        for name in set(stack):
            inclusive[name] += count
        if match:
            position = match.end()
            flags = match.group(2).split()
            if b"1" in flags:
                stack.append("")
            elif b"2" in flags and len(stack) > 1:
                stack.pop()
            stack[-1] = match.group(1).decode(errors="replace")
    return own, inclusive


def is_header(name):
    return bool(name) and not name.startswith("<") and pathlib.PurePath(name).suffix not in SOURCES


def sum_of_headers(counts):
    """Header -> [inclusive lines, own lines, objects], summed over results of lines_by_file."""
    rows = {}
    for own, inclusive in counts:
        for name in filter(is_header, inclusive):
            row = rows.setdefault(name, [0, 0, 0])
            row[0] += inclusive[name]
            row[1] += own[name]
            row[2] += 1
    return rows


def full_names(counter, directory):
    named = collections.Counter()
    for name, count in counter.items():
        known = name if not name or name.startswith("<") else os.path.normpath(os.path.join(directory, name))
        named[known] += count
    return named


def preprocess(entry, preset):
    text = run_compiler([*entry.command, "-E"], entry.directory, entry.output, preset)
    return [full_names(counter, entry.directory) for counter in lines_by_file(text)]


def print_table_of_headers(title, rows):
    print(f"\n{title}\n    with all    alone  objects")
    for name, (inclusive, own, count) in sorted(rows, key=lambda row: (-row[1][0], row[0]))[:TOP]:
        path = pathlib.Path(name)
        print(f"{inclusive:12,}{own:9,}{count:9}  {path.relative_to(ROOT) if path.is_relative_to(ROOT) else path}")


def print_headers(build, preset):
    objects = read_objects(build / "compile_commands.json", preset)
    counts = []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for pair in pool.map(lambda entry: preprocess(entry, preset), objects):
            counts.append(pair)
            progress(f"headers: {len(counts)} of {len(objects)} objects")
    progress()
    rows = sum_of_headers(counts)
    total = sum(row[1] for row in rows.values())
    print(f"\nHeaders: {total:,} lines in {len(objects)} objects, without comments and blank lines. `With all` counts what a header\n"
          "includes as well, unless the object had read that before.")
    print_table_of_headers(f"Dearest {TOP} headers", rows.items())
    ours = [row for row in rows.items() if pathlib.Path(row[0]).is_relative_to(ROOT)]
    print_table_of_headers(f"Dearest {TOP} of our own", ours)


# ---- check


def pick_sample(objects):
    """Objects of the product, sorted by the checksum of their names: added or removed objects leave the rest of the sample unchanged."""
    product = [entry for entry in objects if pathlib.PurePath(entry.output).parts[0] not in NOT_PRODUCT]
    return sorted(product, key=lambda entry: (zlib.crc32(entry.output.encode()), entry.output))[:SAMPLE]


def thousand_lines(sample):
    sources = [source for entry in sample for source in sources_in(entry.source)]
    return sum(len(source.read_bytes().splitlines()) for source in sources) / 1000


def processor_seconds(command, directory, what, preset):
    """User and system time of a compiler and its child processes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run_compiler(command, directory, what, preset)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def yardstick_command(sample, folder):
    """Command that compiles the yardstick with the sample's compiler, independently of the project's flags."""
    source = pathlib.Path(folder, "yardstick.cpp")
    source.write_text(YARDSTICK, encoding="utf-8")
    arguments = [argument.removeprefix("-I") for entry in sample for argument in entry.command]
    eigen = [name for name in arguments if pathlib.Path(name, "Eigen/Dense").is_file()][:1]
    places = ["-isystem", *eigen] if eigen else []
    return [sample[0].command[0], "-std=c++20", "-O1", *places, "-c", str(source), "-o", str(pathlib.Path(folder, "yardstick.o"))]


def measure(sample, preset):
    """(seconds of the sample, list of seconds of the yardstick), of processor time."""
    seconds, yardsticks = 0.0, []
    with tempfile.TemporaryDirectory() as folder:
        def run_yardstick():
            yardsticks.append(processor_seconds(yardstick_command(sample, folder), folder, "the yardstick", preset))

        run_yardstick()
        for number, entry in enumerate(sample, 1):
            progress(f"compiling {number} of {len(sample)}: {entry.output}")
            command = [*entry.command, "-c", "-o", str(pathlib.Path(folder, "sample.o"))]
            seconds += processor_seconds(command, entry.directory, entry.output, preset)
            if number % BETWEEN == 0 or number == len(sample):
                run_yardstick()
    progress()
    return seconds, yardsticks


def figure_of(seconds, kilolines, yardsticks):
    """Cost of a thousand lines, in yardsticks."""
    return seconds / kilolines / statistics.median(yardsticks)


def verdict(figure, recorded):
    """(whether it passes, message)."""
    ratio = figure / recorded
    said = f"{figure:.2f} yardsticks for a thousand lines, recorded are {recorded:.2f}: {ratio:.2f} times that, {LIMIT:g} are allowed"
    if ratio > LIMIT:
        return False, (f"compilation costs too much: {said}.\n"
                       "  deploy/build-times.sh            finds the cause: slowest objects, most expensive headers\n"
                       "  deploy/build-times.sh --record   records the new value, if it is on purpose")
    if ratio * LIMIT < 1:
        return True, f"{said}. Much cheaper: record that with deploy/build-times.sh --record"
    return True, said


def read_record(path, preset):
    """The recorded value."""
    record_it = f"Record a value: deploy/build-times.sh --record --preset {preset}"
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        figure, of = float(record["yardsticks_per_thousand_lines"]), record["preset"]
    except OSError as error:
        raise Problem(f"{path}: {error.strerror}. {record_it}") from None
    except (ValueError, KeyError, TypeError):
        raise Problem(f"{path}: found no record of build times, expected JSON with yardsticks_per_thousand_lines "
                      f"and preset. {record_it}") from None
    if not 0 < figure < float("inf"):
        raise Problem(f"{path}: yardsticks_per_thousand_lines: found {figure}, expected a finite number above zero. {record_it}")
    if of != preset:
        raise Problem(f"{path}: found a value of preset {of}, expected one of {preset}. "
                      f"Check that preset: deploy/build-times.sh --check --preset {of}")
    return figure


def write_record(path, preset, figure, compiler):
    record = {"preset": preset, "compiler": compiler, "yardsticks_per_thousand_lines": round(figure, 3)}
    path.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")


def check_or_record(build, preset, recording):
    """Measures, and records the value or compares it with the recorded one; a Problem if it has doubled."""
    recorded = None if recording else read_record(RECORD, preset)
    sample = pick_sample(read_objects(build / "compile_commands.json", preset))
    if not sample:
        raise Problem(f"{build}: has no object of the product. Build first: {how_to_build(preset)}")
    compiler = run_compiler([sample[0].command[0], "--version"], sample[0].directory, "the compiler", preset).decode().splitlines()[0]
    kilolines = thousand_lines(sample)
    seconds, yardsticks = measure(sample, preset)
    figure = figure_of(seconds, kilolines, yardsticks)
    print(f"{compiler}\n{len(sample)} objects, {kilolines:.2f} thousand lines: {seconds:.1f} s of processor time\n"
          f"yardstick: {statistics.median(yardsticks):.2f} s, median of {len(yardsticks)}, {min(yardsticks):.2f} to {max(yardsticks):.2f}")
    if recording:
        write_record(RECORD, preset, figure, compiler)
        print(f"recorded in {RECORD.relative_to(ROOT)}: {figure:.2f} yardsticks for a thousand lines")
        return
    passes, text = verdict(figure, recorded)
    if not passes:
        raise Problem(text)
    print(text)


def arguments_of(words):
    parser = argparse.ArgumentParser(prog="deploy/build-times.sh", description=HELP, epilog=EXAMPLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="release", metavar="NAME", help="release (default), debug, asan, tsan")
    parser.add_argument("--no-headers", action="store_true", help="leave headers out of the report")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--check", action="store_true", help=f"fail if compilation is over {LIMIT:g} times as expensive as recorded")
    which.add_argument("--record", action="store_true", help="measure as --check does, and record the value")
    return parser.parse_args(words)


def main(words):
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    asked = arguments_of(words)
    build = ROOT / "build" / asked.preset
    try:
        if asked.check or asked.record:
            check_or_record(build, asked.preset, asked.record)
            return 0
        print_times(build, asked.preset)
        if not asked.no_headers:
            sys.stdout.flush()
            print_headers(build, asked.preset)
        return 0
    except Problem as problem:
        progress()
        print(f"build-times.sh: {problem}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        progress()
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
