#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# needs.sh PROGRAM PACKAGE: whether this machine has what tests ask for by tandem_needs(); `python:MODULE` is a module of
# Debian's Python.
set -euo pipefail

program=$1 package=$2
case $program in
  python:*) /usr/bin/python3 -c "import ${program#python:}" 2>/dev/null && exit 0 ;;
  *) PATH=$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null && exit 0 ;;
esac
echo "$program: not found; the tests that need it are not run. Debian's package $package has it: apt-get install $package," \
  "or deploy/test.sh, which installs all that tests need." >&2
exit 1
