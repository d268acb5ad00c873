#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# npm.sh PACKAGE_JSON FOLDER -- COMMAND...: installs the npm packages of PACKAGE_JSON into FOLDER, once, and runs a command with them; a
# package-lock.json beside it gives the exact versions. Exit code 77: the packages are unavailable.
set -euo pipefail

if (($# < 4)) || [[ $3 != -- ]]; then
  echo "Usage: npm.sh PACKAGE_JSON FOLDER -- COMMAND..." >&2
  exit 2
fi
manifest=$1 folder=$2
lock=$(dirname -- "$manifest")/package-lock.json
shift 3

skip() {
  printf '*** SKIPPED: %s. ***\n' "$*" >&2
  exit 77
}

usable() {
  (cd "$folder" && node -e 'Object.keys(require("./package.json").dependencies).forEach((name) => require(name))') \
    2>/dev/null
}
same() { cmp -s "$manifest" "$folder/package.json" && { [[ ! -e $lock ]] || cmp -s "$lock" "$folder/package-lock.json"; }; }

{ command -v node && command -v npm; } >/dev/null || skip "node and npm (Debian: nodejs, npm) are not installed"
mkdir -p "$folder"
if ! same || ! usable; then
  how=(install --no-package-lock)
  if [[ -e $lock ]]; then
    rm -f "$folder/package.json" # until it is installed, nothing here is the same
    cp "$lock" "$folder/"
    how=(ci)
  fi
  cp "$manifest" "$folder/package.json"
  if ! timeout 240 npm "${how[@]}" --prefix "$folder" --no-audit --no-fund >"$folder/npm.log" 2>&1; then
    rm -f "$folder/package.json"
    skip "npm could not install the packages, see $folder/npm.log"
  fi
  usable || skip "the npm packages were installed, but do not load; see $folder/npm.log"
fi
NODE_PATH=$folder/node_modules exec "$@"
