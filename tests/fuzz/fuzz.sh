#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh SECONDS PROGRAM CORPUS...: runs a fuzz target, for TANDEM_FUZZ_SECONDS if that is set, beginning with the corpora. New inputs
# go to the folder found/NAME beside the program and stay for the next run; an input that fails goes to failed/.
set -euo pipefail

seconds=${TANDEM_FUZZ_SECONDS:-$1} program=$2
shift 2
name=$(basename -- "$program")
name=${name#fuzz_}
folder=$(dirname -- "$program")
found=$folder/found/$name failed=$folder/failed/$name-
mkdir -p "$found" "$folder/failed"
dictionary=$folder/dictionary/$name
options=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=512 -max_len=8192 -print_final_stats=1
  -artifact_prefix="$failed")
[[ ! -e $dictionary ]] || options+=(-dict="$dictionary")
status=0
"$program" "${options[@]}" "$found" "$@" || status=$?
if ((status != 0)); then
  echo "an input fails; once more: $program ${failed}HASH. After the repair it belongs to tests/fuzz/corpus/$name." >&2
fi
exit "$status"
