#!/usr/bin/env bash
# The CMakeLists.txt that the README gives firmware works, with the library as a part of another project: the first
# ```cmake fence under the heading "## In your firmware".
# usage: readme_cmake.sh ROOT FOLDER CXX CC KISSFFT
set -euo pipefail
source "$(dirname "$0")/fence.sh"
root=$1 folder=$2
mkdir -p "$folder"
fence "$root/README.md" "In your firmware" cmake >"$folder/CMakeLists.txt"
ln -sfn "$root" "$folder/mellin"
cat >"$folder/main.cpp" <<'CPP'
#include "mellin/core/se2.hpp"
int main() {
  mellin::Sym3 information;
  return invert(mellin::diagonal(4.0, 2.0, 1.0), information) && information.xx == 0.25 ? 0 : 1;
}
CPP
cmake -S "$folder" -B "$folder/build" -G Ninja "-DCMAKE_CXX_COMPILER=$3" "-DCMAKE_C_COMPILER=$4" \
  "-DMELLIN_KISSFFT_SOURCE_DIR=$5"
cmake --build "$folder/build" --parallel 2
"$folder/build/firmware"
