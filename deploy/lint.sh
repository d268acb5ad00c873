#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Static checks of the sources; see --help.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/lint.sh [--fix] [--all | --since REV] [--most N] [--no-install] [WHAT...]

Checks format and style of the sources: of all files, except `tidy`, which takes 10 to 20 s per file. WHAT is one or several of
these (default: all):

  format   clang-format on C++                                  .clang-format
  shell    shellcheck on shell scripts
  python   flake8 on Python                                     .flake8
  page     eslint on console/; prettier there and on all        console/eslint.config.js, .prettierrc
           JavaScript
  tidy     clang-tidy, with the rules for names, on C++ files   .clang-tidy
           that changed; a header is checked in a source that
           includes it

Prints each violation as FILE:LINE. Exit codes: 1 violations found, 77 a check could not run. `tidy` and `page` use the files that
deploy/test.sh has built in build/release, and build those that are missing.

  --fix         let clang-format, prettier and eslint correct the files
  --since REV   tidy: files that differ from this revision. Default: where the branch left origin/main; on origin/main itself, or
                where there is none, the commit before
  --all         tidy: all files; hours
  --most N      tidy: of more sources than this check N, evenly spread, and list the skipped ones (default 12; with --all
                no limit)
  --no-install  install no packages; neither apt nor root is needed
  --help        this text

Examples:
  deploy/lint.sh                     everything, as deploy/test.sh does
  deploy/lint.sh --fix format page   formats what you wrote
  deploy/lint.sh --since HEAD tidy   what is not committed yet
TEXT
}

install=true fix=false all=false since='' most=''
what=()
while (($# > 0)); do
  case $1 in
    --fix) fix=true ;;
    --all) all=true ;;
    --no-install) install=false ;;
    --since | --most)
      (($# > 1)) || die "$1: expected a value; see deploy/lint.sh --help"
      if [[ $1 == --since ]]; then since=$2; else most=$2; fi
      shift
      ;;
    format | shell | python | page | tidy) what+=("$1") ;;
    -h | --help) usage && exit 0 ;;
    *) die "$1: expected format, shell, python, page, tidy or an option; see deploy/lint.sh --help" ;;
  esac
  shift
done
((${#what[@]} > 0)) || what=(format shell python page tidy)
if $all; then most=${most:-1000000}; else most=${most:-12}; fi
[[ $most =~ ^[1-9][0-9]*$ ]] || die "--most: found '$most', expected a number from 1"

cd "$root"
repository() { git -c safe.directory="$root" "$@"; }
# Without a repository (sources from an archive), the patterns of .gitignore apply as well.
where=(--no-index --exclude-standard)
! repository rev-parse --verify -q HEAD >/dev/null 2>&1 || where=(--untracked)
# files PATTERN...: sources with these names, including untracked ones.
files() { repository grep -I -l "${where[@]}" -e '' -- "$@"; }

format() {
  local how=(--dry-run -Werror)
  ! $fix || how=(-i)
  files '*.cpp' '*.h' '*.c' | xargs -d '\n' clang-format "${how[@]}"
}

shell() {
  { files '*.sh' && files ':!*.sh' | xargs -d '\n' awk 'FNR == 1 && /^#!.*[ \/](ba|da)?sh$/ { print FILENAME } { nextfile }'; } |
    xargs -d '\n' shellcheck -x --source-path SCRIPTDIR --format gcc
}

python() { files '*.py' '*.pyi' | xargs -d '\n' flake8; }

# eslint needs the packages beside the sources: it reads a copy of them in the page's build folder, which has the packages.
page() {
  local folder=$root/build/release/console status=0
  local copy=$folder/lint npm=$folder/node_modules/.bin check=(--check) fixes=()
  ! $fix || check=(--write) fixes=(--fix)
  tests/integration/harness/npm.sh console/package.json "$folder" -- true || return
  mkdir -p "$copy"
  rm -rf "${copy:?}"/*
  cp -r console/{src,test,eslint.config.js,tsconfig.json} "$copy/"
  /usr/bin/python3 -B idl/generate.py build --out "$copy/generated"
  cp "$copy/generated/messages.ts" "$copy/src/wire/"
  (cd "$copy" && "$npm/eslint" ${fixes[@]+"${fixes[@]}"} .) | sed "s|^$copy/|console/|" || status=1
  rm "$copy/src/wire/messages.ts"
  ! $fix || cp -r "$copy"/{src,test} console/
  files '*.js' 'console/*.ts' 'console/*.css' 'console/*.html' |
    xargs -d '\n' "$npm/prettier" --log-level warn "${check[@]}" || status=1
  return "$status"
}

# changed REV: C++ files that differ from it, and untracked ones.
changed() {
  repository diff --name-only --diff-filter=d "$1" -- '*.cpp' '*.h'
  repository ls-files --others --exclude-standard -- '*.cpp' '*.h'
}

tidy() {
  local build=$root/build/release base=''
  if [[ ! -e $build/compile_commands.json || -z $(find "$build/idl/generated" -name '*.h' -print -quit 2>/dev/null) ]]; then
    configure release -DTANDEM_TESTS=ON
    build release tandem_idl
  fi
  if ! $all && [[ ${where[0]} == --untracked ]]; then
    base=$since
    [[ -n $base ]] || base=$(repository merge-base HEAD origin/main 2>/dev/null) || true
    if [[ -z $since && ( -z $base || $base == $(repository rev-parse HEAD) ) ]]; then base=HEAD~1; fi
    if ! repository rev-parse -q --verify "$base^{commit}" >/dev/null; then
      [[ -z $since ]] || die "--since $since: no revision of this repository; git log has them"
      say "left out: no revision before this one is here (a shallow clone?). deploy/lint.sh --all tidy does not need one"
      return 77
    fi
  elif ! $all; then
    say "left out: no repository says what changed. deploy/lint.sh --all tidy does not need one"
    return 77
  fi
  if [[ -n $base ]]; then
    say "what differs from $(repository rev-parse --short "$base")" >&2
    changed "$base"
  else
    files '*.cpp' '*.h'
  fi | /usr/bin/python3 -B deploy/tidy.py "$build" "$most"
}

prepare "$install" run page test lint
wrong=() skipped=false
for one in "${what[@]}"; do
  say "$one"
  status=0
  case $one in
    format) format ;;
    shell) shell ;;
    python) python ;;
    page) page ;;
    tidy) tidy ;;
  esac || status=$?
  case $status in
    0) ;;
    77) skipped=true ;; # it has said why
    *) wrong+=("$one") ;;
  esac
done
((${#wrong[@]} == 0)) ||
  die "checks failed: ${wrong[*]}. deploy/lint.sh --fix format page corrects format violations; correct the others by hand"
! $skipped || exit 77
