#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the benchmarks, runs them, and prints one table.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/bench.sh [--output FILE] [--no-install] [--table FILE] [BENCHMARK ARGUMENTS]

Installs the Debian packages that are missing, builds bench_kinematics, runs it and prints one table: time per call of
forward kinematics with its Jacobian, us, and how many times longer a textbook solution takes in the same run. Percentiles
are over the joint vectors (10,000; 400 for the textbook solution), each with the best of five repetitions, so that they
tell of the code and not of what else the machine did. All other arguments go to Google Benchmark.

  --output FILE  the results as JSON (default: results/bench_kinematics.json)
  --table FILE   prints the table of earlier results; runs nothing
  --no-install   use what is installed; neither apt nor root is needed
  --help         this text

Example:
  deploy/bench.sh --benchmark_filter=ark2024
TEXT
}

# The table of a JSON file.
table() {
  /usr/bin/python3 - "$1" <<'PYTHON'
import json
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    results = json.load(file)
rows = {}
for run in results["benchmarks"]:
    rows[tuple(run["name"].split("/")[:4])] = run
times = ("p50", "p90", "p99", "p999", "max")
cpu = results["context"]
print(f"{cpu['date']}, {cpu['num_cpus']} CPUs at {cpu['mhz_per_cpu']} MHz, load {cpu.get('load_avg', ['?'])[0]}; "
      "time per call, us; ratio: shooting (unloaded) / this, p50")
head = f"{'model':<11}{'arm':<10}{'curved parts':<14}{'joints':<13}"
print(head + "".join(f"{name:>11}" for name in times) + f"{'failed':>8}{'ratio':>8}")
for (model, arm, overlap, use), run in rows.items():
    peer = rows.get(("shooting", arm, overlap, use))
    ratio = f"{peer['p50'] / run['p50']:.0f}" if peer and run["p50"] > 0 else "-"
    print(f"{model:<11}{arm:<10}{overlap:<14}{use:<13}"
          + "".join(f"{run[name]:>11.2f}" for name in times) + f"{run['failed']:>8.0f}{ratio:>8}")
PYTHON
}

install=true output=$root/results/bench_kinematics.json
arguments=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --output | --table)
      (($# > 1)) || die "$1: expected a file"
      if [[ $1 == --table ]]; then
        table "$2"
        exit
      fi
      output=$2
      shift
      ;;
    -h | --help) usage && exit 0 ;;
    *) arguments+=("$1") ;;
  esac
  shift
done

if $install; then install_packages; else report_packages; fi
build release bench_kinematics
mkdir -p "$(dirname -- "$output")"
say "running bench_kinematics"
"$root/build/release/bin/bench_kinematics" --benchmark_out="$output" --benchmark_out_format=json \
  --benchmark_format=console ${arguments[@]+"${arguments[@]}"} >"${output%.json}.log" ||
  die "bench_kinematics failed; see ${output%.json}.log"
say "results in $output"
table "$output"
