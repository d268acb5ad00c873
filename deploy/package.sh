#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the Debian packages.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/package.sh [--no-install]

Builds preset release and writes its Debian packages, with their SHA-256 sums, to build/release/packages.

  --no-install   install no packages; neither apt nor root is needed
  --help         this text
TEXT
}

install=true
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    -h | --help) usage && exit 0 ;;
    *) usage >&2 && printf '\n' >&2 && die "unknown option: $1" ;;
  esac
  shift
done

prepare "$install" run python page containers
configure release -DTANDEM_PYTHON=ON -DTANDEM_PAGE=ON
build release services/all
rm -rf "$root/build/release/packages"
(cd "$root/build/release" && cpack -G DEB) || die "cpack could not make the packages"
say "packages: $root/build/release/packages"
