#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs missing packages, builds, and runs the tests.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/test.sh [--preset NAME] [--no-install] [--room NAME] [CTEST ARGUMENTS]

Installs the Debian packages that are missing, builds, and runs ctest. All other arguments go to ctest. Tests with the
label `long` run only if a label is given with -L. Unit tests run two at a time, all others one by one, because they
start processes in real time. If the host of a virtual machine took 5 % or more of the processor time, those of
these others that failed run once more, with a note; not those with the label `fault`, which judge each process on its own clock.
A complete run also checks the list of hazards (docs/hazards.md), and the cost of compilation against the recorded value
(deploy/build-times.sh --check).
Exit code: that of ctest, or 1 if the tests do not show a hazard's control.

Presets other than `release` skip checks whose result is the same for all: source style (label `lint`), hazards, build times.
The sanitizers `asan` (addresses and undefined behaviour) and `tsan` (threads) are built without Python module and page, and run the
labels `unit` and `integration_in_process`; processes with deadlines are too slow under them. Name a test to run it nevertheless.
Preset `fuzz` builds the fuzz targets of tests/fuzz with clang++, and gives each TANDEM_FUZZ_SECONDS (default 30).

  --preset NAME  release (default), debug, asan, tsan, each-file, fuzz
  --room NAME    build and run the unit tests of one folder of tests/unit only: control, services, cli ...
  --no-install   install no packages; neither apt nor root is needed
  --help         this text

Examples:
  deploy/test.sh                    everything but the long tests
  deploy/test.sh -L unit            one label
  deploy/test.sh --room control     after a change in control/: its own tests, in seconds
  deploy/test.sh -R Gate            tests whose names contain Gate
  deploy/test.sh --preset tsan      with the thread sanitizer
  deploy/test.sh --preset asan -R wire_malformed
  TANDEM_FUZZ_SECONDS=600 deploy/test.sh --preset fuzz -R fuzz_eds
TEXT
}

install=true preset=release room='' exclude='' long=false
arguments=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --preset)
      (($# > 1)) || die "--preset: expected a name"
      preset=$2
      shift
      ;;
    --preset=*) preset=${1#*=} ;;
    --room)
      [[ $# -gt 1 && -e $root/tests/unit/$2/CMakeLists.txt ]] ||
        die "--room: found '${2-}', expected one of: $(cd "$root/tests/unit" && printf '%s ' */ | tr -d /)"
      room=$2
      arguments+=(-L "^$room\$")
      shift
      ;;
    -LE | --label-exclude)
      # Several -LE of ctest exclude tests that match all of them; here they are joined into one that excludes tests that match any.
      (($# > 1)) || die "$1: expected a regular expression"
      exclude+="|$2"
      shift
      ;;
    -h | --help) usage && exit 0 ;;
    *)
      [[ $1 != -L && $1 != --label-regex ]] || long=true
      arguments+=("$1")
      ;;
  esac
  shift
done
$long || exclude+='|^long$'

mapfile -t all < <(purposes)
prepare "$install" "${all[@]}"
# With sanitizers, g++ warns about the inserted code.
sanitized=false more=ON
[[ $preset != asan && $preset != tsan ]] || sanitized=true more=OFF
[[ $preset == release ]] || exclude+='|^lint$'
if [[ $preset == fuzz ]]; then
  configure fuzz
  build fuzz tests/fuzz/all
else
  configure "$preset" -DTANDEM_TESTS=ON -DTANDEM_WERROR=$more -DTANDEM_PYTHON=$more -DTANDEM_PAGE=$more
  if [[ -n $room ]]; then build "$preset" "tests/unit/$room/all"; else build "$preset"; fi
fi
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
cd "$root/build/$preset"

# Debian's Fast DDS, Ipopt, fmt ... are built without the sanitizer, which therefore cannot observe their locks: races inside them are
# ignored. Debian's libraries also free objects at process exit with another size than allocated. There are no other suppressions.
[[ $preset != asan ]] || export ASAN_OPTIONS="new_delete_type_mismatch=0 ${ASAN_OPTIONS:-}"
[[ $preset != tsan ]] || export TSAN_OPTIONS="ignore_noninstrumented_modules=1 ${TSAN_OPTIONS:-}"

# Processor time taken by the host (steal) and total demanded time, in ticks since boot.
ticks() { awk '$1 == "cpu" { print $9, $2 + $3 + $4 + $7 + $8 + $9 }' /proc/stat; }
# stolen BEFORE: percentage of the time demanded since then that the host took.
stolen() { printf '%s %s\n' "$1" "$(ticks)" | awk '{ print(($4 > $2) ? int(100 * ($3 - $1) / ($4 - $2)) : 0) }'; }

ran=false status=0
# run NAME JOBS SELECTION...: runs the requested tests that match SELECTION; does nothing if there are none.
run() {
  local name=$1 jobs=$2 count before share code=0
  shift 2
  count=$(ctest -N ${arguments[@]+"${arguments[@]}"} "$@" | sed -n 's/^Total Tests: //p') || return 1
  ((${count:-0} > 0)) || return 0
  ran=true
  say "$name tests: $count, $jobs at a time"
  before=$(ticks)
  ctest -j "$jobs" --output-on-failure --output-junit "$results/$name.xml" ${arguments[@]+"${arguments[@]}"} "$@" | tee "$results/$name" || code=$?
  share=$(stolen "$before")
  if ((code != 0 && share >= 5)) && [[ $name == other ]]; then
    say "the host took $share % of the processor time away: what failed is run once more"
    code=0
    ctest -j "$jobs" --rerun-failed --output-on-failure --output-junit "$results/${name}_again.xml" | tee -a "$results/$name" || code=$?
  fi
  ((status != 0)) || status=$code
}
# Lists the failed tests at the end, each with the end of its output, which would be lost in a log of thousands of lines.
failures() {
  local name
  for name in lint unit fault other; do
    [[ ! -e $results/${name}_again.xml ]] || name+=_again
    [[ -e $results/$name.xml ]] || continue
    /usr/bin/python3 - "$results/$name.xml" <<'PYTHON'
import sys, xml.etree.ElementTree as tree
for case in tree.parse(sys.argv[1]).iter("testcase"):
    if case.find("failure") is not None:
        print(f"==> failed: {case.get('name')}", *(case.findtext("system-out") or "").splitlines()[-25:], sep="\n    ")
PYTHON
  done
}
run lint 1 -L '^lint$' ${exclude:+-LE "${exclude#|}"}
run unit 2 -L '^unit$' ${exclude:+-LE "${exclude#|}"}
{ $sanitized && ((${#arguments[@]} == 0)); } || run fault 1 -L '^fault$' ${exclude:+-LE "${exclude#|}"}
others=(-LE "^(unit|lint|fault)\$$exclude")
! $sanitized || ((${#arguments[@]} > 0)) || others+=(-L '^integration_in_process$')
run other 1 "${others[@]}"

$ran || die "no test matches: ${arguments[*]}"
say "summary, preset $preset"
(cd "$results" && grep -Hs "tests passed" -- lint unit fault other | sed "s/:/ tests: /") || true
((status == 0)) || failures
if ((${#arguments[@]} == 0)); then
  say "slowest tests, s"
  grep -ho '<testcase name="[^"]*"[^>]* time="[^"]*"' "$results"/*.xml |
    sed -E 's/.* name="([^"]*)".* time="([^"]*)"/\2 \1/' | sort -rn | awk 'NR <= 10 { printf "%8.1f  %s\n", $1, $2 }'
fi
# A part of the tests covers only a part of the hazards.
if ((${#arguments[@]} == 0)) && [[ $preset == release && $exclude == '|^long$' ]]; then
  /usr/bin/python3 "$root/tests/hazards/trace.py" --results "$results"/*.xml || status=1
  say "compilation cost against the recorded value"
  "$root/deploy/build-times.sh" --check || status=1
fi
exit "$status"
