#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# linux_uml.sh FOLDER [ARGUMENT]...: runs linux.uml (Debian package user-mode-linux), on processors with AMX together with
# uml_registers.cpp, compiled into FOLDER, which must exist as long as it runs. It runs on one processor: each system call of a guest
# process switches from one host process to another and back, and waking another processor costs several times as much.
set -euo pipefail

folder=$1
shift
if grep -q -m 1 -w amx_tile /proc/cpuinfo; then
  here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
  "${CXX:-c++}" -std=c++20 -O1 -shared -fPIC -o "$folder/registers.so" "$here/uml_registers.cpp"
  export LD_PRELOAD=$folder/registers.so
fi
exec taskset -c "$(taskset -cp $$ | sed 's/.*[ ,-]//')" linux.uml "$@"
