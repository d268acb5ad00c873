#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the benchmarks, runs them, and prints one table.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/bench.sh [--output FOLDER] [--no-install] [--table FILE] [BENCHMARK ARGUMENTS]

Installs the Debian packages that are missing, builds the benchmarks, runs them and prints a table of each, times in us:

  bench_kinematics  forward kinematics with its Jacobian, beside a textbook solution in the same run
  bench_control     one quadratic programme and one control step, beside Ipopt in the same run
  bench_hal         one cycle of the HAL, two arms on two buses, beside what its frames take on a wire of 1 Mbit/s
  bench_security    a round trip from state to command between two participants, secured beside plain
  instructions.py   instructions per call, counted by callgrind, against bench/instructions.json: more than 5 % above is an error
  bench_round_trip  state to control to command over DDS, beside a bare Fast DDS ping-pong of messages of the same size

Percentiles are over the cases (10,000 joint vectors, 2,000 programmes or steps, 5,000 cycles; fewer for the slow
peers), each with the best of five repetitions, so that they tell of the code and not of what else the machine did; over
5,000 round trips, each as it was. All other arguments go to Google Benchmark.

  --output FOLDER  for the results, bench_*.json (default: results)
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
times = ("p50", "p90", "p99", "p999", "max")
cpu = results["context"]
print(f"{cpu['date']}, {cpu['num_cpus']} CPUs at {cpu['mhz_per_cpu']} MHz, load {cpu.get('load_avg', ['?'])[0]}; time per call, us")
runs = [(run["name"].split("/iterations")[0].split("/"), run) for run in results["benchmarks"]]
if runs and runs[0][0][0] == "hal":
    print(f"{'what':<14}{'robot':<14}{'state':<14}" + "".join(f"{name:>11}" for name in times) + f"{'failed':>8}"
          f"{'frames in':>11}{'out':>8}")
    for name, run in runs:
        print("".join(f"{part:<14}" for part in name) + "".join(f"{run[time]:>11.2f}" for time in times)
              + f"{run['failed']:>8.0f}{run['received']:>11.2f}{run['sent']:>8.2f}")
    run = runs[-1][1]
    print(f"on the wire of one bus, by the calculator: {run['wire']:.0f} us of a cycle of {run['period']:.0f} us, load "
          f"{100 * run['load']:.1f} %; wire and HAL one after the other: {100 * run['wire_share']:.2f} % is the wire's")
    sys.exit()
if runs and runs[0][0][0] == "round_trip":
    (_, first), bare = runs[0][0], runs[0][1]
    print(f"{'round trip':<14}" + "".join(f"{name:>11}" for name in times) + f"   ratio to {first}: p50, p99, p999")
    for name, run in runs:
        ratios = ", ".join(f"{run[time] / bare[time]:.2f}" for time in ("p50", "p99", "p999"))
        print(f"{name[1]:<14}" + "".join(f"{run[time]:>11.1f}" for time in times) + f"   {ratios}")
    sys.exit()
kinematics = any(name[0] == "shooting" or name[0] in ("rigid", "compliant", "loaded") for name, _ in runs)
heads, peer = ((("model", "arm", "curved parts", "joints"), (0, "shooting")) if kinematics else
               (("what", "problem", "solver", "start"), (2, "ipopt")))
print("".join(f"{head:<{38 if head == 'problem' else 14}}" for head in heads)
      + "".join(f"{name:>11}" for name in times) + f"{'failed':>8}{'ratio':>8}  (median of {peer[1]} / of this)")
medians = {tuple(name): run["p50"] for name, run in runs}
for name, run in runs:
    other = list(name)
    other[peer[0]] = peer[1]
    beside = medians.get(tuple(other)) or (None if kinematics else medians.get(tuple(other[:3] + ["cold"])))
    ratio = f"{beside / run['p50']:.0f}" if beside and run["p50"] > 0 else "-"
    print("".join(f"{part:<{38 if head == 'problem' else 14}}" for head, part in zip(heads, name))
          + "".join(f"{run[time]:>11.2f}" for time in times) + f"{run['failed']:>8.0f}{ratio:>8}")
PYTHON
}

install=true output=$root/results
arguments=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --output | --table)
      (($# > 1)) || die "$1: expected a name"
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
build release bench_kinematics bench_control bench_hal bench_round_trip bench_security bench_instructions services/all
mkdir -p "$output"
for program in bench_kinematics bench_control bench_hal bench_round_trip bench_security; do
  say "running $program"
  "$root/build/release/bin/$program" --benchmark_out="$output/$program.json" --benchmark_out_format=json \
    --benchmark_format=console ${arguments[@]+"${arguments[@]}"} >"$output/$program.log" ||
    die "$program failed; see $output/$program.log"
  say "results in $output/$program.json"
  table "$output/$program.json"
done
say "counting instructions"
/usr/bin/python3 "$root/bench/instructions.py" "$root/build/release/bin/bench_instructions" --output "$output/instructions.json"
