# SPDX-License-Identifier: Apache-2.0
# Functions shared by the scripts of this folder; sourced under `set -euo pipefail`. Sets `root`, the source tree.
# shellcheck shell=bash

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)

say() { printf '==> %s\n' "$*"; }

die() {
  printf '%s: %s\n' "$(basename -- "$0")" "$*" >&2
  exit 1
}

# The purposes of packages.txt, one per line.
purposes() { sed -n 's/^\[\(.*\)\]$/\1/p' "$root/deploy/packages.txt"; }

# packages PURPOSE...: the lines of packages.txt under these headings.
packages() {
  awk -v wanted=" $* " '
    { sub(/[ \t]*#.*/, ""); sub(/[ \t]+$/, "") }
    /^\[.*\]$/ { take = index(wanted, " " substr($0, 2, length($0) - 2) " "); next }
    take && NF && !seen[$0]++' "$root/deploy/packages.txt"
}

# missing_packages PURPOSE...: those of them that are not installed according to dpkg.
missing_packages() {
  local package unless command
  while read -r package unless command; do
    [[ $unless == unless ]] && command -v "$command" >/dev/null && continue
    dpkg-query -W -f='${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || printf '%s\n' "$package"
  done < <(packages "$@")
}

require_debian() {
  local id='' version='' name='an unknown system'
  if [[ -r /etc/os-release ]]; then
    # shellcheck disable=SC1091
    id=$(. /etc/os-release && printf '%s' "${ID:-}")
    # shellcheck disable=SC1091
    version=$(. /etc/os-release && printf '%s' "${VERSION_ID:-}")
    # shellcheck disable=SC1091
    name=$(. /etc/os-release && printf '%s' "${PRETTY_NAME:-$id}")
  fi
  [[ $id == debian ]] || die "this is $name, not Debian 12. Install the packages of deploy/packages.txt with your system's package manager,
then run this script with --no-install."
  [[ $version == 12 ]] || say "this is $name; Tandem is developed on Debian 12, other versions may fail to build"
}

# Runs a command as root, through sudo if necessary.
as_root() {
  if ((EUID == 0)); then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    die "packages are missing, and this user has neither root rights nor sudo. Run as root:
  apt-get install ${missing[*]}"
  fi
}

# install_packages PURPOSE...: installs the missing packages; needs neither network nor apt if there are none.
install_packages() {
  local missing
  require_debian
  mapfile -t missing < <(missing_packages "$@")
  if ((${#missing[@]} == 0)); then
    say "all packages are installed ($*)"
    return
  fi
  say "installing ${#missing[@]} missing packages ($*): ${missing[*]}"
  as_root apt-get -q -o DPkg::Lock::Timeout=300 update ||
    die "apt-get update failed; is there a network, and may this user use sudo?"
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 \
    install --no-install-recommends "${missing[@]}" || die "apt-get could not install: ${missing[*]}"
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) || die "still missing after the installation: ${missing[*]}"
}

# report_packages PURPOSE...: with --no-install, reports packages without which a build may fail. Not an error, since the libraries may come
# from elsewhere.
report_packages() {
  command -v dpkg-query >/dev/null || return 0
  local missing
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) || say "not installed, and left so: ${missing[*]}"
}

# prepare INSTALL PURPOSE...: installs (true) or reports (false).
prepare() {
  local install=$1
  shift
  if $install; then install_packages "$@"; else report_packages "$@"; fi
}

# Number of parallel compilations: one per core, with 1.5 GB of memory for each.
build_jobs() {
  local cores memory
  cores=$(nproc)
  memory=$(awk '/^MemAvailable:/ {print int($2 / 1572864)}' /proc/meminfo 2>/dev/null || true)
  memory=${memory:-1}
  printf '%d' $((memory < 1 ? 1 : memory < cores ? memory : cores))
}

# configure PRESET [OPTION...]: a new build folder excludes tests, Python module and page unless an option includes them; an existing one
# keeps its options.
configure() {
  local preset=$1 tool
  shift
  if [[ ! -e $root/build/$preset/CMakeCache.txt ]]; then
    set -- -DTANDEM_TESTS=OFF -DTANDEM_PYTHON=OFF -DTANDEM_PAGE=OFF "$@"
  fi
  for tool in cmake ninja c++ fastddsgen /usr/bin/python3; do
    command -v "$tool" >/dev/null || die "$tool: not found; run without --no-install, or install deploy/packages.txt"
  done
  mkdir -p "$root/build" 2>/dev/null || true
  [[ -w $root/build ]] || die "$root/build: not writable for $(id -un); change its owner, or use a copy of the sources"
  say "configuring preset $preset in $root/build/$preset"
  # Debian's Python has the packages of packages.txt; another one in PATH may lack them.
  (cd "$root" && cmake --preset "$preset" -DPython3_EXECUTABLE=/usr/bin/python3 "$@" --log-level=NOTICE) ||
    die "cmake could not configure preset $preset"
}

# build PRESET [TARGET...]: builds the targets; without targets, everything that is configured.
build() {
  local preset=$1
  shift
  say "building with $(build_jobs) jobs"
  (cd "$root" && cmake --build --preset "$preset" -j "$(build_jobs)" ${1:+--target "$@"}) || die "the build failed"
}
