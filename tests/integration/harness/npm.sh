#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# npm.sh PACKAGE_JSON FOLDER -- COMMAND...: installs the npm packages that PACKAGE_JSON names into FOLDER, once, and runs
# a command that finds them. Exit code 77: they cannot be had here.
set -euo pipefail

(($# > 3)) && [[ $3 == -- ]] || { echo "Usage: npm.sh PACKAGE_JSON FOLDER -- COMMAND..." >&2 && exit 2; }
manifest=$1 folder=$2
shift 3

skip() {
  printf '*** SKIPPED: %s. ***\n' "$*" >&2
  exit 77
}

usable() {
  (cd "$folder" && node -e 'Object.keys(require("./package.json").dependencies).forEach((name) => require(name))') \
    2>/dev/null
}

command -v node >/dev/null && command -v npm >/dev/null || skip "node and npm (Debian: nodejs, npm) are not installed"
mkdir -p "$folder"
if ! cmp -s "$manifest" "$folder/package.json" || ! usable; then
  cp "$manifest" "$folder/package.json"
  timeout 240 npm install --prefix "$folder" --no-audit --no-fund --no-package-lock >"$folder/npm.log" 2>&1 ||
    skip "npm could not install the packages, see $folder/npm.log"
  usable || skip "the npm packages were installed, but do not load; see $folder/npm.log"
fi
NODE_PATH=$folder/node_modules exec "$@"
