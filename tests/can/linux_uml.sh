#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# linux_uml.sh FOLDER [ARGUMENT]...: linux.uml (Debian package user-mode-linux), on processors with AMX as well: there with
# uml_registers.cpp, compiled into FOLDER, which has to stay as long as it runs. It runs on one processor: each system call of
# what runs in it goes from one process to another and back, and to wake another processor costs several times as much.
set -euo pipefail

folder=$1
shift
if grep -q -m 1 -w amx_tile /proc/cpuinfo; then
  here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
  "${CXX:-c++}" -std=c++20 -O1 -shared -fPIC -o "$folder/registers.so" "$here/uml_registers.cpp"
  export LD_PRELOAD=$folder/registers.so
fi
exec taskset -c "$(taskset -cp $$ | sed 's/.*[ ,-]//')" linux.uml "$@"
