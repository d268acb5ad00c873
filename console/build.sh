#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# build.sh FOLDER: builds the page in a copy of its sources; the result is FOLDER/dist. If npm's packages are unavailable, it reports that
# and succeeds without a page: everything else of Tandem is built, and the server reports the missing page.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
folder=$1
export TANDEM_SOURCE=${here%/*}
mkdir -p "$folder"
rm -rf "$folder/src" "$folder/test" "$folder/public"
cp -r "$here"/{src,test,public,index.html,tsconfig.json,vite.config.ts} "$folder/"
cd "$folder"
/usr/bin/python3 -B "$TANDEM_SOURCE/idl/generate.py" build --out generated
cp generated/messages.ts src/wire/
status=0
"$TANDEM_SOURCE/tests/integration/harness/npm.sh" "$here/package.json" "$folder" -- npm run --silent build >build.log 2>&1 ||
  status=$?
if ((status == 77)); then
  rm -rf dist
  tail -n 1 build.log >&2
  echo "*** The operator's page is not built; all else is. ***" >&2
  exit 0
fi
((status == 0)) || { cat build.log >&2 && exit "$status"; }
touch page.stamp
