#!/usr/bin/env bash
# The main job, from logs to a map; does all of its own set-up on Debian 12 (root, or a user with sudo).
# usage: tools/demo.sh [LOG…]      CARMEN logs, plain or .gz; without one: a simulated building, whose truth is known
set -euo pipefail
logs=()
for log in "$@"; do
  [ -r "$log" ] || { echo "demo.sh: cannot read $log" >&2; exit 1; }
  logs+=("$(realpath "$log")")
done
cd "$(dirname "$0")/.."

tools/packages.sh build source
cmake --preset host >/dev/null
cmake --build --preset host --parallel "$(nproc)" --target mellin_program
mellin=build/host/bin/mellin
out=build/demo

if [ ${#logs[@]} -gt 0 ]; then
  "$mellin" map "${logs[@]}" -o "$out/map"
else
  "$mellin" sim -o "$out/sim" --seed 1
  "$mellin" map "$out/sim/sim-0.log" -o "$out/map"
  "$mellin" score "$out/map/trajectory-0.tum" "$out/sim/sim-0.tum"
fi
echo "map picture: $PWD/$out/map/map.png"
echo "report:      $PWD/$out/map/report.html"
