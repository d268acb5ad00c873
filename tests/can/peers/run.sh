#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# run.sh MODULES EXECUTABLES TEST_EXECUTABLES [TEST...]: peers_test.py in user-mode Linux, with npm's packages installed
# in the folder MODULES.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
exec "$here/../../integration/harness/npm.sh" "$here/package.json" "$1" -- \
  "$here/../uml.sh" --can vcan0 --timeout 280 -- env NODE_PATH="$1/node_modules" \
  /usr/bin/python3 "$here/peers_test.py" "${@:2}"
