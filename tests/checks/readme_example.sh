#!/usr/bin/env bash
# The README's example compiles, runs, and prints what the README says it prints: the first ```cpp fence under the
# heading "## Example", and the first ```text fence after it.
# usage: readme_example.sh README FOLDER COMPILER ARGUMENT…
set -euo pipefail
readme=$1 folder=$2 compiler=$3
shift 3
mkdir -p "$folder"

# fence LANGUAGE: the lines of the first such fence in the section
fence() {
  awk -v open="\`\`\`$1" '
    inside && /^```/ {exit}
    inside {print; next}
    /^## / {section = ($0 == "## Example")}
    section && $0 == open {inside = 1}' "$readme"
}

fence cpp >"$folder/example.cpp"
fence text >"$folder/expected.txt"
[ -s "$folder/example.cpp" ] || { echo "no \`\`\`cpp fence under \"## Example\" in $readme"; exit 1; }
[ -s "$folder/expected.txt" ] || { echo "no \`\`\`text fence under \"## Example\" in $readme"; exit 1; }
"$compiler" -std=c++17 -O1 -Wall -Wextra -Werror -fno-exceptions -fno-rtti "$folder/example.cpp" "$@" -o "$folder/example"
"$folder/example" >"$folder/printed.txt"
diff -u "$folder/expected.txt" "$folder/printed.txt"
