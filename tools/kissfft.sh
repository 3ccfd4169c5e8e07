#!/usr/bin/env bash
# Fetches KissFFT's C sources (Debian's source package) once and prints the folder that holds kiss_fft.c.
# usage: tools/kissfft.sh          cache: $MELLIN_CACHE, else $XDG_CACHE_HOME/mellin, else ~/.cache/mellin
#
# Debian does not enable source packages by default; a private list made from the machine's own avoids touching that.
set -euo pipefail
cache=${MELLIN_CACHE:-${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/mellin}
mkdir -p "$cache"
found() { find "$cache/src" -maxdepth 2 -name kiss_fft.c -print -quit 2>/dev/null; }
if [ -z "$(found)" ]; then
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  mkdir -p "$work/lists/partial" "$work/src"
  {
    for f in /etc/apt/sources.list.d/debian.sources; do
      [ -e "$f" ] || continue
      awk '/^URIs:/{u=$2} /^Suites:/{$1=""; s=$0} /^Components:/{$1=""; n=split(s, a, " "); for (i = 1; i <= n; i++) print "deb-src", u, a[i] $0}' "$f"
    done
    for f in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
      [ -e "$f" ] || continue
      awk '$1 == "deb" && /debian/ {$1 = "deb-src"; print}' "$f"
    done
  } >"$work/sources.list"
  apt=(-o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$work/lists")
  apt-get "${apt[@]}" update -qq >&2
  (cd "$work/src" && apt-get "${apt[@]}" source -qq --download-only kissfft >&2)
  (cd "$work/src" && dpkg-source --no-check -x ./*.dsc kissfft >/dev/null 2>&1)
  rm -rf "$cache/src"
  mv "$work/src" "$cache/src"
fi
dirname "$(found)"
