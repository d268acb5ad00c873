#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Replicates Table 3 of Alsaka et al. 2024 in Python, without any of the program's code, and compares the program with it.

Model, methods, quadratic programmes and closed loop are written from the paper and from the documents that say how its unclear places
are read (docs/reproduction.md, docs/methods.md). Prints each run and the averages of Table 3.
"""
import argparse
import subprocess
import sys
import tempfile

import numpy as np

import comparison
import paper
import protocol

EXAMPLES = """
examples:
  replicate.py                                    the replication alone
  replicate.py --tandem build/release/bin/tandem  runs the program and compares
  replicate.py --csv results/csv                  compares with what tandem experiment table3 --csv results/csv wrote
  replicate.py --spread 4                         how much runs change when the start moves by 1e-11

exit codes: 0 all runs agree, or nothing to compare with; 1 at least one deviates; 2 wrong arguments or files"""


def starts(text):
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a number of starts from 1")
    return int(text)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--tandem", metavar="PATH", help="program that runs `experiment table3 --offline`")
    source.add_argument("--csv", metavar="FOLDER", help="folder that `tandem experiment table3 --csv FOLDER` wrote")
    source.add_argument("--spread", metavar="N", type=starts,
                        help="repeat each run from N starts that differ by random 1e-11 (m, rad), and print how far results differ")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    return parser.parse_args()


def progress(text, quiet):
    if not quiet:
        print(text, file=sys.stderr, flush=True)


def run_all(quiet, moved=0.0, random=None):
    """The 18 runs of Table 3, from starts moved by `moved` times normally distributed numbers."""
    cases = [(t, c, m) for t in paper.TRAJECTORIES for m in paper.METHODS for c in paper.CONFIGURATIONS]
    runs = []
    for number, (trajectory, configuration, method) in enumerate(cases, 1):
        start = paper.CONFIGURATIONS[configuration]
        if moved:
            start = start + moved * random.normal(size=len(start))
        run = protocol.run(trajectory, configuration, method, start)
        progress(f"{number:2d}/{len(cases)} {trajectory} {configuration} {method}: {run.iterations} iterations, "
                 f"{run.converged} of {run.points} points reached", quiet)
        runs.append(run)
    return runs


def program_runs(options):
    """Runs of the program, by trajectory, configuration and method; none if none is asked for."""
    if options.csv:
        return comparison.read(options.csv)
    if not options.tandem:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        command = [options.tandem, "experiment", "table3", "--offline", "--csv", folder]
        progress("runs " + " ".join(command), options.quiet)
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        except OSError as error:
            raise ValueError(f"--tandem: {error}") from error
        if done.returncode != 0:
            raise ValueError(f"{' '.join(command)} ended with exit code {done.returncode}:\n{done.stdout}")
        return comparison.read(folder)


def print_spread(options):
    random = np.random.default_rng(1)
    print("seed 1; largest minus smallest of", options.spread + 1, "starts: iterations; RMS, standard deviation, maximum in mm")
    every = [run_all(options.quiet)] + [run_all(options.quiet, 1e-11, random) for _ in range(options.spread)]
    for same in zip(*every):
        numbers = np.array([(run.iterations, *run.relative, *run.tip) for run in same])
        ends = np.ptp(numbers, axis=0)
        print("{:<10} {:<7} {}".format(same[0].trajectory, same[0].method, same[0].configuration),
              "{:3.0f}   epsilon_AB {:.4f} {:.4f} {:.4f}   epsilon_A {:.4f} {:.4f} {:.4f}".format(*ends))


def main():
    options = arguments()
    if options.spread:
        print_spread(options)
        return 0
    try:
        program = program_runs(options)
    except ValueError as error:
        print(f"replicate.py: {error}", file=sys.stderr)
        return 2
    replicated = run_all(options.quiet)
    print(comparison.per_run(replicated, program))
    print("\nAverages over the configurations", comparison.averages(replicated, program), sep="\n")
    if not program:
        return 0
    found = comparison.compare(replicated, program)
    print("", *(f"deviates: {text}" for text in found), sep="\n")
    print(f"{len(replicated)} runs compared, {len(found)} deviations")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
