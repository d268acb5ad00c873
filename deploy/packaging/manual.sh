#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Writes a manual page for each command and program, from their --help.
set -euo pipefail
(($# == 3)) || { printf 'Usage: deploy/packaging/manual.sh BIN VERSION FOLDER\n\nBIN: folder of the programs. help2man is needed.\n' >&2 && exit 2; }
bin=$1 version=$2 folder=$3
mkdir -p "$folder/man1" "$folder/man8"

# page SECTION NAME WORDS...
page() {
  local section=$1 name=$2 file about
  shift 2
  file=$folder/man$section/$name.$section
  about=$("$bin/$1" "${@:2}" --help | sed -n 1p)
  help2man --no-info --section "$section" --version-string "$version" --name "$about" --source "Tandem $version" "$bin/$*" |
    sed -e "s/^\.TH .* \"$section\"/.TH ${name^^} \"$section\"/" -e "/^\.SH NAME/{n;s/.* \\\\- /${name//-/\\\\-} \\\\- /}" \
      -e '/^\.SH EXAMPLES/{n;s/$/\n.nf/}' >"$file.new"
  mv "$file.new" "$file"
}

page 1 tandem tandem
while read -ra words; do
  page 1 "tandem-$(IFS=-; printf '%s' "${words[*]}")" tandem "${words[@]}"
done < <("$bin/tandem" __commands)
for program in "$bin"/tandem-*; do
  page 8 "$(basename -- "$program")" "$(basename -- "$program")"
done
