# SPDX-License-Identifier: Apache-2.0
"""Instructions per call of the models and the methods, counted by callgrind, compared with the recorded counts.

    instructions.py BENCH_INSTRUCTIONS [--baseline FILE] [--output FILE] [--update]

Exit code 1: a count is more than 5 % above its baseline; --update writes the baseline again. In contrast to times, counts do not
depend on the load of the machine. The C library is configured to use only instructions that all processors have, so that counts
are the same on another processor, too."""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

MOST = 1.05
CALLS = 50
PORTABLE = "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-FMA,-FMA4"


def count(program, case, calls):
    with tempfile.TemporaryDirectory(prefix="tandem-count-") as folder:
        output = pathlib.Path(folder, "out")
        subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={output}", "--collect-atstart=no",
                        "--toggle-collect=tandem_measured", program, case, str(calls)],
                       check=True, capture_output=True, env={**os.environ, "GLIBC_TUNABLES": PORTABLE})
        return int(re.search(r"^summary: (\d+)", output.read_text(), re.MULTILINE).group(1)) / calls


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--baseline", type=pathlib.Path, default=pathlib.Path(__file__).with_name("instructions.json"))
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--update", action="store_true")
    arguments = parser.parse_args()
    cases = subprocess.run([arguments.program, "--list"], check=True, capture_output=True, text=True).stdout.splitlines()
    baseline = json.loads(arguments.baseline.read_text()) if arguments.baseline.exists() and not arguments.update else {}
    counts, slower = {}, []
    print(f"{'instructions per call':<40}{'now':>12}{'baseline':>12}{'change':>9}")
    for case in cases:
        now = counts[case] = round(count(arguments.program, case, CALLS))
        before = baseline.get(case)
        change = f"{100 * (now / before - 1):+.1f} %" if before else "new"
        print(f"{case:<40}{now:>12}{before or '':>12}{change:>9}", flush=True)
        if before and now > MOST * before:
            slower.append(case)
    target = arguments.baseline if arguments.update else arguments.output
    if target:
        target.write_text(json.dumps(counts, indent=2) + "\n")
    missing = [] if arguments.update else [case for case in cases if case not in baseline]
    if missing:
        print(f"not in the baseline; bench/instructions.py {arguments.program} --update writes it: " + ", ".join(missing))
    if slower:
        print(f"more than {100 * (MOST - 1):.0f} % above the baseline: " + ", ".join(slower))
    return 1 if slower or missing else 0


if __name__ == "__main__":
    sys.exit(main())
