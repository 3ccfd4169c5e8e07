#!/usr/bin/env bash
# Fetches KissFFT's C sources (Debian's source package) once and prints the folder that holds kiss_fft.c.
# usage: tools/kissfft.sh          cache: $MELLIN_CACHE, else $XDG_CACHE_HOME/mellin, else ~/.cache/mellin
#
# Debian does not enable source packages by default; private lists made from the machine's own leave those as they are,
# and no root is needed.
set -euo pipefail
tools=$(cd "$(dirname "$0")" && pwd)
cache=${MELLIN_CACHE:-${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/mellin}
kissfft=$cache/kissfft
if [ -e "$kissfft/kiss_fft.c" ] && [ -e "$kissfft/kiss_fftr.c" ]; then
  echo "$kissfft"
  exit
fi

command -v dpkg-source >/dev/null || "$tools/packages.sh" source
mkdir -p "$cache"
work=$(mktemp -d "$cache/fetching.XXXXXX") # beside its final place, so that the move at the end is atomic
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{parts,lists/partial,cache/archives/partial,source}

# Only Debian's own archives: others may have no sources to offer.
shopt -s nullglob
for f in /etc/apt/sources.list.d/*.sources; do
  awk 'BEGIN {RS = ""; ORS = "\n\n"} /\/debian/ && /[Cc]omponents:[^\n]*main/' "$f" |
    sed 's/^[Tt]ypes:.*/Types: deb-src/' >"$work/parts/$(basename "$f")"
done
for f in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
  [ -e "$f" ] || continue
  sed -nE '/\/debian.*[[:space:]]main/s/^[[:space:]]*deb[[:space:]]/deb-src /p' "$f" >"$work/parts/$(basename "$f" .list).list"
done

apt=(apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$work/parts" -o "Dir::State::lists=$work/lists"
  -o "Dir::Cache=$work/cache" -o APT::Sandbox::User="$(id -un)")
fetch() {
  "${apt[@]}" update # its failure need not matter: what does is whether the source package can be had
  # apt checks the files against the signed index; the maintainer's own signature would add nothing to that.
  cd "$work/source" && "${apt[@]}" source --download-only kissfft && dpkg-source --no-check -x ./*.dsc "$work/kissfft"
}
if ! (fetch) >"$work/log" 2>&1 </dev/null || [ ! -e "$work/kissfft/kiss_fft.c" ]; then
  cat "$work/log" >&2
  echo "kissfft.sh: cannot fetch Debian's source package kissfft; give a folder that holds kiss_fft.c to CMake:" \
    "-DMELLIN_KISSFFT_SOURCE_DIR=DIR" >&2
  exit 1
fi
rm -rf "$kissfft"
mv -T "$work/kissfft" "$kissfft" 2>/dev/null || [ -e "$kissfft/kiss_fft.c" ] # somebody else may have been faster
echo "$kissfft"
