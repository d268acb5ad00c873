# SPDX-License-Identifier: Apache-2.0
"""clang-tidy on some C++ files; deploy/lint.sh tidy calls it.

    tidy.py BUILD MOST    the files, relative to the working directory, a line each on standard input

A unity build compiles several sources at a time: each gets the command of the one that it is in. A header is checked in the nearest
source that includes it. Findings in other files than those asked for do not count."""
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from build_log import Problem, sources_in
from build_times import read_objects

# g++ knows the first ones, clang does not. The last two are about kernel macros, and untaken branches of templates.
EXTRA = ["--extra-arg=-Wno-unknown-warning-option", "--extra-arg=-Wno-ignored-optimization-argument",
         "--extra-arg=-Wno-unused-command-line-argument", "--extra-arg=-Wno-format-security",
         "--extra-arg=-Wno-unknown-attributes", "--extra-arg=-Wno-sign-compare",
         "--extra-arg=-Wno-division-by-zero"]


def commands(build, tree):
    """source, relative to the tree -> its entry in compile_commands.json."""
    found = {}
    for item in read_objects(build / "compile_commands.json", build.name):
        if not item.source.is_file():  # a unity file of an earlier configuration
            continue
        for source in sources_in(item.source):
            arguments = [str(source) if part == str(item.source) else part for part in item.command]
            entry = {"directory": item.directory, "file": str(source), "arguments": arguments}
            found.setdefault(os.path.relpath(source, tree), entry)
    return found


def includers(tree, sources):
    """header -> files that include it, for all headers reachable from the sources of the tree."""
    found, open_ = collections.defaultdict(list), list(sources)
    seen = set(open_)
    for name in open_:
        for header in re.findall(r'^\s*#\s*include "(.+)"', (tree / name).read_text(encoding="utf-8"), re.MULTILINE):
            if not (tree / header).is_file():
                header = os.path.normpath(os.path.join(os.path.dirname(name), header))
                if not (tree / header).is_file():
                    continue
            found[header].append(name)
            if header not in seen:
                seen.add(header)
                open_.append(header)
    return found


def source_of(name, known, including):
    """The source in which a file is checked: itself, the one of its name, or the nearest that includes it; None if there is none."""
    twin = os.path.splitext(name)[0] + ".cpp"
    level, seen = [name], {name}
    while level:
        sources = sorted(one for one in level if one in known)
        if sources:
            return twin if twin in sources else sources[0]
        level = [one for header in level for one in including[header] if one not in seen]
        seen.update(level)
    return None


def check(source, names, folder, tree):
    """Output of clang-tidy about these files when it compiles the source."""
    lines = json.dumps([{"name": str(tree / name)} for name in names])
    command = ["clang-tidy", "-p", folder, "--quiet", "--header-filter=.*", f"--line-filter={lines}", *EXTRA, str(tree / source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    text = done.stdout.replace(f"{tree}/", "")
    if done.returncode and "error:" not in text:
        text += f"{source}:1: error: clang-tidy cannot read it: {done.stderr.strip()}\n"
    return done.returncode, text


def main():
    build, most, tree = pathlib.Path(sys.argv[1]), int(sys.argv[2]), pathlib.Path.cwd()
    asked = sorted(set(sys.stdin.read().splitlines()))
    known = commands(build, tree)
    including = includers(tree, [name for name in known if not name.startswith("..")])
    work, without = collections.defaultdict(list), []
    for name in asked:
        source = source_of(name, known, including)
        if source is None:
            without.append(name)
        else:
            work[source].append(name)
    chosen = sorted(work)
    if len(chosen) > most:
        chosen = [chosen[k * len(chosen) // most] for k in range(most)]
    left_out = [name for source in sorted(set(work) - set(chosen)) for name in work[source]]
    status = 0
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        pathlib.Path(folder, "compile_commands.json").write_text(json.dumps([known[source] for source in chosen]), encoding="utf-8")
        for code, text in pool.map(lambda source: check(source, work[source], folder, tree), chosen):
            print(text, end="", flush=True)
            status = status or code
    print(f"clang-tidy: {len(asked)} files changed, {len(asked) - len(left_out) - len(without)} checked")
    for why, names in (("more than --most; not checked", left_out), ("compiled by no target; not checked", without)):
        if names:
            print(f"{why}: {' '.join(names)}")
    return 1 if status else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Problem as problem:
        sys.exit(f"tidy.py: {problem}")
