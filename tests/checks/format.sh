#!/usr/bin/env bash
# Every C and C++ file is as clang-format leaves it.      usage: format.sh ROOT
set -euo pipefail
cd "$1"
mapfile -t files < <(find include src port tests tools -name '*.[ch]' -o -name '*.[ch]pp' | sort)
[ ${#files[@]} -gt 0 ]
clang-format --dry-run -Werror "${files[@]}"
echo "${#files[@]} files"
