# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# shellcheck disable=SC2016
# What the pages that are logs of their commands have in common (tutorial.sh, lab-day.sh). Sourced with the page's name and a new folder:
# `source walk.sh tutorial FOLDER`. It changes into the folder; tests/docs/walk_test.py compares the pages with a new run.
walk_page=${1:?walk.sh PAGE FOLDER}
mkdir -- "${2:?FOLDER: a new folder for the files of the page}"
cd -- "$2" || exit
export TANDEM_DOMAIN=${TANDEM_DOMAIN:-0}
background=

# Ends the system that the page started, also after an error.
end() {
  [[ -n $background ]] || return 0
  kill -INT "$background" 2>/dev/null || true
  wait "$background" 2>/dev/null || true
  background=
}
trap end EXIT

# Text of the page.
say() { printf '\n%s\n' "$(cat)"; }

# run [-x CODE] [-v] COMMAND: prints the command and its output. -x: its exit code; -v: the numbers vary from run to run.
run() {
  local code=0 expected=0 fence=console output
  while [[ $1 == -? ]]; do
    case $1 in
      -x) expected=$2 && shift 2 ;;
      -v) fence='console varies' && shift ;;
      *) break ;;
    esac
  done
  output=$(bash -c "set -o pipefail; $1" 2>&1 </dev/null) || code=$?
  printf '\n```%s\n$ %s\n' "$fence" "$1"
  [[ -z $output ]] || printf '%s\n' "$output"
  printf '```\n'
  ((code == expected)) || { printf '%s.sh: %s: exit code %d, expected %d\n' "$walk_page" "$1" "$code" "$expected" >&2 && exit 1; }
}

# picture NAME TEXT: the page shows NAME.png of the folder.
picture() { printf '\n![%s](images/%s-%s.png)\n' "$2" "$walk_page" "$1"; }

# Starts the system of a deployment in the background and waits until it is ready.
up() {
  printf '\n```console\n$ tandem up %s &\n```\n' "$1"
  : >up.log
  tandem up "$1" >up.log 2>&1 &
  background=$!
  for ((k = 0; k < 1200; ++k)); do
    ! grep -q '^ready after' up.log || return 0
    kill -0 "$background" || break
    sleep 0.1
  done
  cat up.log >&2
  exit 1
}
