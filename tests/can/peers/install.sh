#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the npm packages of package.json into a folder, once. Exit code 77: they cannot be had here.
set -euo pipefail

(($# == 1)) || { echo "Usage: install.sh FOLDER" >&2 && exit 2; }
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)

skip() {
  printf '*** SKIPPED: %s. Nothing was tested against the CANopen of others. ***\n' "$*" >&2
  exit 77
}

usable() { (cd "$1" && node -e 'require("canopen"); require("socketcan")') 2>/dev/null; }

command -v node >/dev/null && command -v npm >/dev/null || skip "node and npm (Debian: nodejs, npm) are not installed"
mkdir -p "$1"
if cmp -s "$here/package.json" "$1/package.json" && usable "$1"; then exit 0; fi
cp "$here/package.json" "$1/package.json"
# Both have parts in C++, which npm compiles.
timeout 240 npm install --prefix "$1" --no-audit --no-fund --no-package-lock >"$1/npm.log" 2>&1 ||
  skip "npm could not install the packages, see $1/npm.log"
usable "$1" || skip "the npm packages were installed, but do not load; see $1/npm.log"
