#!/usr/bin/env bash
# Installs what is missing of the Debian 12 packages in the sets named; says nothing and touches nothing when all are
# there. Runs as root, or as a user with sudo.
# usage: tools/packages.sh SET…   sets: build (library, program, benchmarks), source (to fetch KissFFT), test (checks),
#                                 target (cross compilers and emulators)
set -euo pipefail

declare -A sets=(
  [build]="cmake ninja-build g++ libeigen3-dev doctest-dev libcli11-dev nlohmann-json3-dev libpng-dev zlib1g-dev libfftw3-dev libbenchmark-dev python3"
  [source]="ca-certificates dpkg-dev xz-utils"
  [test]="binutils clang clang-tidy clang-format"
  [target]="gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf g++-aarch64-linux-gnu g++-arm-linux-gnueabihf qemu-system-arm qemu-system-misc qemu-user"
)

wanted=()
for set in "$@"; do
  [ -n "${sets[$set]:-}" ] || { echo "packages.sh: no set '$set'; there are: ${!sets[*]}" >&2; exit 2; }
  read -ra names <<<"${sets[$set]}"
  wanted+=("${names[@]}")
done

missing=()
for package in "${wanted[@]}"; do
  state=$(dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null || true)
  grep -qx installed <<<"$state" || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "packages.sh: neither root nor sudo; ask for: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() { "$@" >"$log" 2>&1 </dev/null || { cat "$log" >&2; return 1; }; }

echo "Installing ${missing[*]}" >&2
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)
# A list that fails to refresh need not matter: installing says what is really missing.
quietly "${apt[@]}" update || true
quietly "${apt[@]}" install -y --no-install-recommends "${missing[@]}"
