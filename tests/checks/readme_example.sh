#!/usr/bin/env bash
# The README's example compiles, runs, and prints what the README says it prints: the first ```cpp and ```text fences
# under the heading "## Example".
# usage: readme_example.sh README FOLDER COMPILER ARGUMENT…
set -euo pipefail
source "$(dirname "$0")/fence.sh"
readme=$1 folder=$2 compiler=$3
shift 3
mkdir -p "$folder"
fence "$readme" Example cpp >"$folder/example.cpp"
fence "$readme" Example text >"$folder/expected.txt"
"$compiler" -std=c++17 -O1 -Wall -Wextra -Werror -fno-exceptions -fno-rtti "$folder/example.cpp" "$@" -o "$folder/example"
"$folder/example" >"$folder/printed.txt"
diff -u "$folder/expected.txt" "$folder/printed.txt"
