# SPDX-License-Identifier: Apache-2.0
"""Batch forward kinematics: Python compared with C++ in the same run, on one core and on all.

    batch.py BIN --output FILE    BIN: folder of a build tree's executables; the Python module is in python/ beside it

The two run alternately, and the best time of each counts, so that both run under the same conditions. On one thread processor time
counts if another process had the processor in between."""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

SIZES = (1, 10, 100, 1000, 10_000, 100_000)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.bin.resolve().parent / "python"))
    import tandem  # pylint: disable=import-outside-toplevel,import-error

    robot = tandem.Robot.load("ark2024")
    results = []
    print(f"{'model':<12}{'rows':>8}{'threads':>9}{'C++, us/row':>13}{'Python':>9}{'ratio':>7}")
    with tempfile.TemporaryDirectory(prefix="tandem-batch-") as folder:
        file = pathlib.Path(folder, "joints")
        for model in "rigid", "compliant":
            arm = robot.arm("a", model=model)
            for size in arguments.sizes:
                joints = arm.sample(size, seed=1)
                joints.tofile(file)
                repetitions = max(1, min(100, 5000 // size))
                rounds = 3 if size > 10_000 else 7
                for threads in sorted({1, os.cpu_count()}):
                    cpp = python = float("inf")
                    for _ in range(rounds):
                        words = [arguments.bin / "bench_batch", file, model, threads, repetitions]
                        answer = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True).stdout.split()
                        cpp = min(cpp, float(answer[0]))
                        for _ in range(repetitions):
                            poses = None  # frees the memory before the next result, as in C++
                            begin, before = time.perf_counter(), time.thread_time()
                            poses = arm.forward(joints, threads=threads)
                            python = min(python, time.perf_counter() - begin)
                            if threads == 1:
                                python = min(python, time.thread_time() - before)
                    if abs(poses.sum() - float(answer[1])) > 1e-9 * size:
                        sys.exit(f"{model}, {size} rows: Python and C++ differ")
                    result = {"model": model, "rows": size, "threads": threads, "cpp_us": 1e6 * cpp / size,
                              "python_us": 1e6 * python / size, "ratio": python / cpp}
                    results.append(result)
                    print(f"{model:<12}{size:>8}{threads:>9}{result['cpp_us']:>13.3f}{result['python_us']:>9.3f}"
                          f"{result['ratio']:>7.2f}", flush=True)
    arguments.output.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
