# SPDX-License-Identifier: Apache-2.0
"""The shortest sequence of random faults that still fails: removes faults from a failing sequence as long as it fails without them.

    reduce_faults.py FOLDER_OF_EXECUTABLES SEED NUMBER,NUMBER,...

The numbers are those that random_faults_test.py printed, up to the one that failed; those of the set-up of the failing one suffice."""
import os
import pathlib
import subprocess
import sys


def fails(folder, seed, numbers):
    """Whether the test fails with these faults in this order."""
    environment = {**os.environ, "TANDEM_SEED": seed, "TANDEM_FAULTS": ",".join(numbers) + ","}
    test = pathlib.Path(__file__).with_name("random_faults_test.py")
    failed = subprocess.run([sys.executable, str(test), folder], env=environment, capture_output=True, check=False).returncode != 0
    print(f"{'fails ' if failed else 'passes'} {','.join(numbers)}", flush=True)
    return failed


def reduced(sequence, still_fails):
    """Removes parts, from halves to single elements, as long as `still_fails` is true of the rest."""
    size = len(sequence) // 2
    while size > 0:
        begin = 0
        while begin < len(sequence):
            rest = sequence[:begin] + sequence[begin + size:]
            if rest and still_fails(rest):
                sequence = rest
            else:
                begin += size
        size //= 2
    return sequence


def main():
    folder, seed, numbers = sys.argv[1], sys.argv[2], sys.argv[3].split(",")
    if not fails(folder, seed, numbers):
        sys.exit("this sequence passes: the failure depends on something else, such as the load of the machine; run it again")
    shortest = reduced(numbers, lambda rest: fails(folder, seed, rest))
    print(f"TANDEM_SEED={seed} TANDEM_FAULTS={','.join(shortest)}, {pathlib.Path(__file__).with_name('random_faults_test.py')} {folder}")


if __name__ == "__main__":
    main()
