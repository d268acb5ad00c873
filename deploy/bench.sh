#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the benchmarks, runs them, and prints one table.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/bench.sh [--output FOLDER] [--no-install] [--table FOLDER] [BENCHMARK ARGUMENTS]

Installs the Debian packages that are missing, builds the benchmarks, runs them, prints one table of all, times in us, and
writes results (all of them in bench.json) and figures:

  bench_kinematics  tip, Jacobian and stability, compared with a textbook solution in the same run; catheters
  bench_control     one quadratic programme and one control step, compared with Ipopt in the same run
  bench_cycle       control's whole cycle for each method; one to eight arms, two to four tubes
  bench_hal         one cycle of the HAL, two arms on two buses, compared with the time of its frames at 1 Mbit/s
  bench_round_trip  state to control to command over DDS, compared with a plain Fast DDS ping-pong of the same size
  bench_security    a round trip from state to command between two participants, secured and plain
  batch.py          tip poses in batches of 1 to 100,000, Python compared with C++ in the same run, on one core and on all
  simulation.py     lock-step simulation, in one process and over DDS; Monte Carlo, on one core and on all
  stops.py          stops at 1 kHz with real processes, on the wall clock, beside a thread that measures the host
  instructions.py   instructions per call, counted by callgrind; error: more than 5 % above bench/instructions.json

Percentiles are over the cases (10,000 joint vectors, 2,000 programmes, steps or cycles, 5,000 cycles of the HAL; fewer for
the slow peers), each with the best of five repetitions and without the time of other processes, so that they depend on the code and not
on the load of the machine. Those of the 5,000 round trips use every measured value. All other arguments go to Google Benchmark.

  --output FOLDER  folder for results and figures (default: results/bench)
  --table FOLDER   print the table of earlier results; run nothing
  --no-install     install no packages; neither apt nor root is needed
  --help           this text

Example:
  deploy/bench.sh --benchmark_filter=ark2024
TEXT
}

install=true output=$root/results/bench
arguments=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --output | --table)
      (($# > 1)) || die "$1: expected a name"
      if [[ $1 == --table ]]; then
        exec /usr/bin/python3 "$root/bench/report.py" "$2"
      fi
      output=$2
      shift
      ;;
    -h | --help) usage && exit 0 ;;
    *) arguments+=("$1") ;;
  esac
  shift
done

prepare "$install" run python figures test bench page
configure release -DTANDEM_TESTS=ON -DTANDEM_PYTHON=ON
programs=(bench_kinematics bench_control bench_cycle bench_hal bench_round_trip bench_security)
build release "${programs[@]}" bench_batch bench_instructions _tandem services/all
bin=$root/build/release/bin
mkdir -p "$output"
for program in "${programs[@]}"; do
  say "running $program"
  "$bin/$program" --benchmark_out="$output/$program.json" --benchmark_out_format=json \
    --benchmark_format=console ${arguments[@]+"${arguments[@]}"} >"$output/$program.log" ||
    die "$program failed; see $output/$program.log"
done
say "running batch.py"
/usr/bin/python3 "$root/bench/batch.py" "$bin" --output "$output/batch.json" >"$output/batch.log" || die "batch.py failed"
say "running simulation.py"
/usr/bin/python3 "$root/bench/simulation.py" "$bin/tandem" --output "$output/simulation.json" || die "simulation.py failed"
say "running stops.py"
/usr/bin/python3 "$root/bench/stops.py" "$bin" --output "$output/stops.json" >"$output/stops.log" 2>&1 || die "stops.py failed; see $output/stops.log"
say "counting instructions"
status=0
/usr/bin/python3 "$root/bench/instructions.py" "$bin/bench_instructions" --output "$output/instructions.json" || status=$?
say "results and figures in $output"
/usr/bin/python3 "$root/bench/report.py" "$output" --figures "$output"
((status == 0)) || die "instructions.py ended with exit code $status, see above"
