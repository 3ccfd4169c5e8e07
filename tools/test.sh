#!/usr/bin/env bash
# Passes the tests; does all of its own set-up on Debian 12 (root, or a user with sudo).
# usage: tools/test.sh [--host]      --host: without the targets, a quick loop for people
#
# Builds with GCC, with the sanitizers, with Clang and clang-tidy, and for each target, warnings being errors in each; then
# runs the tests of all builds in one ctest, those of the targets in emulators; its closing lines end the output. Exit
# status 0 only if everything was built and passed. What takes minutes a case is left out (ctest label long).
set -euo pipefail
cd "$(dirname "$0")/.."

host_only=false
case "${1:-}" in
  "") ;;
  --host) host_only=true ;;
  *) sed -n 's/^# \(usage: .*\)/\1/p' "$0" >&2; exit 2 ;;
esac

step() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }

# Presets that are built, and those of them whose tests are run.
packages=(build source test)
built=(host asan tidy)
tested=(host asan)
labels=(host)
if ! $host_only; then
  targets=(cortex-m4f cortex-m7 cortex-m33 cortex-m55 rv32imafc aarch64-linux armhf-linux)
  packages+=(target)
  built+=("${targets[@]}")
  tested+=("${targets[@]}")
  labels+=(target)
fi

step "Packages"
tools/packages.sh "${packages[@]}"

launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
for preset in "${built[@]}"; do
  step "Build: $preset"
  cmake --preset "$preset" "${launcher[@]}" >/dev/null
  cmake --build "build/$preset" --parallel "$(nproc)"
done

# One ctest over several build folders, so that one summary tells all.
mkdir -p build/tests
for preset in "${tested[@]}"; do
  echo "subdirs(\"$PWD/build/$preset\")"
done >build/tests/CTestTestfile.cmake
step "Tests: ${tested[*]}"
pattern=$(IFS='|' && echo "^(${labels[*]})\$")
ctest --test-dir build/tests --label-regex "$pattern" --label-exclude '^long$' --no-tests=error --output-on-failure \
  --timeout 600 --parallel "$(nproc)"
