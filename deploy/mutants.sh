#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds all mutants of tests/mutants/mutants.yaml into one copy of the programs and runs the tests of their hazards with each.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
usage: deploy/mutants.sh [--no-install] [--shard I/N] [--seed N] [--processes] [--folder DIR]

Runs each mutant until a test of its hazard fails, and writes docs/mutants.md when it has the results of all.

  --shard I/N    part I, from 0, of N: on several machines, or one after another
  --seed N       order in which the mutants run (default 1)
  --processes    for mutants that pass the unit tests, run those with processes, too
  --folder DIR   copy of the sources, its build and the results (default build/mutants); a run goes on where an earlier one ended
  --no-install   no installation of packages

Takes 15 minutes for the build and a few seconds for each mutant on 2 cores.
TEXT
}

install=true shard=0/1 folder=$root/build/mutants
options=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --shard) shard=$2 && shift ;;
    --seed) options+=(--seed "$2") && shift ;;
    --processes) options+=(--processes) ;;
    --folder) folder=$(realpath -m -- "$2") && shift ;;
    -h | --help) usage && exit ;;
    *) usage >&2 && die "unknown argument: $1" ;;
  esac
  shift
done
prepare $install run python test

program=(/usr/bin/python3 "$root/tests/mutants/mutants.py")
page=$root/docs/mutants.md tree=$folder/tree results=$folder/results-${shard//\//-of-}.jsonl
mkdir -p "$tree"
"${program[@]}" --apply "$tree"
root=$tree
configure release -DTANDEM_TESTS=ON -DTANDEM_PYTHON=ON -DTANDEM_WERROR=OFF
build release
say "running mutants, results in $results"
"${program[@]}" --run "$tree/build/release" --results "$results" --shard "$shard" "${options[@]}"
if [[ $shard == 0/1 ]]; then "${program[@]}" --write "$page" "$results"; fi
