#!/usr/bin/env bash
# Runs a firmware image on its board, emulated where it is not this machine. The image's output is this command's, and so
# is its exit status; without an end it is for the caller to stop it (timeout 60 port/run.sh …).
# usage: port/run.sh BOARD IMAGE.elf [ARGUMENT…]     boards: mps2-an386 mps2-an500 mps2-an505 mps3-an547 riscv-virt posix
set -euo pipefail
[ $# -ge 2 ] || { sed -n 's/^# \(usage: .*\)/\1/p' "$0" >&2; exit 2; }
board=$1
image=$2
shift 2
# A folder with a run.sh of its own, in port/ or elsewhere: how that board is run.
case $board in
  /*) own=$board/run.sh ;;
  *) own=$(dirname "$0")/$board/run.sh ;;
esac
[ ! -e "$own" ] || exec bash "$own" "$image" "$@"

# Instructions instead of time drive the emulated clock, so that each run counts the same: 2^6 ns an instruction on ARM,
# where the timers' frequency sets the resolution, 1 ns on RISC-V, where the processor itself counts.
semihosting="enable=on,target=native,arg=$(basename "$image" .elf)"
for argument; do
  semihosting+=",arg=${argument//,/,,}"
done
quiet=(-display none -serial none -monitor none -semihosting-config "$semihosting" -kernel "$image")
case $board in
  mps2-* | mps3-*) exec qemu-system-arm -M "$board" -icount shift=6 "${quiet[@]}" ;;
  riscv-virt) exec qemu-system-riscv32 -M virt -bios none -icount shift=0 "${quiet[@]}" ;;
  posix) ;;
  *) echo "run.sh: no board '$board'" >&2; exit 2 ;;
esac

# A program of an operating system: of this machine, or of another processor.
machine=$(od -An -t u2 -j 18 -N 2 "$image" | tr -d ' ') # e_machine of the ELF header
case $machine-$(uname -m) in
  62-x86_64 | 183-aarch64 | 40-armv7l) exec "$image" "$@" ;;
  183-*) exec qemu-aarch64 -L /usr/aarch64-linux-gnu "$image" "$@" ;;
  40-*) exec qemu-arm -L /usr/arm-linux-gnueabihf "$image" "$@" ;;
  *) echo "run.sh: $image is for a processor that is not known here (ELF machine $machine)" >&2; exit 2 ;;
esac
