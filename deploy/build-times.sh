#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Report of build times, and check of the cost of compilation; see --help. Implemented in build_times.py and build_log.py.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

[[ -x /usr/bin/python3 ]] || die "/usr/bin/python3: not found; install what deploy/packages.txt names"
exec /usr/bin/python3 -B "$root/deploy/build_times.py" "$@"
