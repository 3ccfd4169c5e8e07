#!/usr/bin/env bash
# What each part of the method is worth: maps the real logs and two simulated ones with each part switched off in turn,
# and prints a line a variant: ATE, mean of the relations where there are any, m, and seconds, log by log.
# usage: tools/ablation.sh [VARIANT…]      all without one; they are named below
# Logs: $MELLIN_DATA, else ../shared/data, as in tools/accuracy.sh. MELLIN is the program (build/host/bin/mellin). Two runs
# at a time; results in build/ablation.
set -euo pipefail
cd "$(dirname "$0")/.."
mellin=${MELLIN:-$PWD/build/host/bin/mellin}
out=$PWD/build/ablation

options() {  # of a variant
  case $1 in
    default) ;;
    refine-only) echo --set matcher.search_distance_m=0 --set matcher.search_angle_rad=0 ;;
    search-only) echo --set matcher.max_iterations=0 ;;
    no-smoothing) echo --set submaps.smoother.iterations=0 ;;
    no-drift-limit) echo --set submaps.max_drift_m=1000 --set submaps.max_drift_rad=1000 ;;
    no-path-limit) echo --set submaps.max_path_m=1000 --set submaps.every_path_m=1000 ;;
    no-bias) echo --set mapper.odometry.learn_bias=0 ;;
    no-search-gain) echo --set matcher.search_gain=0 ;;
    no-monitor) echo --set monitor.lost_scans=0 ;;
    no-nearby) echo --set collection.nearby_candidates=0 ;;
    no-alignment) echo --set registration.alignment.max_iterations=1 ;;
    no-loops) echo --no-loops ;;
    particles-2 | particles-10 | particles-30) echo --set mapper.particles="${1#particles-}" ;;
    remember-20 | remember-80) echo --set remembered_scans="${1#remember-}" ;;
    hardly-forgetting) echo --set remembered_scans=180 --set submaps.smoother.iterations=0 ;;
    particles-10-hardly-forgetting)
      echo --set mapper.particles=10 --set remembered_scans=180 --set submaps.smoother.iterations=0 ;;
    *) return 1 ;;
  esac
}
all=(default refine-only search-only no-bias no-search-gain no-monitor no-smoothing no-drift-limit no-path-limit no-nearby
  no-alignment no-loops particles-2 particles-10 particles-30 remember-20 remember-80 hardly-forgetting particles-10-hardly-forgetting)

# One run: ablation.sh --one VARIANT LOG TRUTH [RELATIONS]; writes "ATE/relations/seconds"
if [ "${1-}" = --one ]; then
  variant=$2 log=$3 truth=$4 relations=${5:+--relations $5}
  run=$out/$variant-$(basename "${log%.gz}" .log)
  # shellcheck disable=SC2046,SC2086  # the options are words
  "$mellin" map "$log" -o "$run" $(options "$variant") >/dev/null
  # shellcheck disable=SC2086
  "$mellin" score "$run/trajectory-0.tum" "$truth" $relations --json |
    python3 -c '
import json, sys
s, m = json.load(sys.stdin), json.load(open(sys.argv[1]))
r = s.get("relations")
print("%.3f%s %.0fs" % (s["ate_rmse_m"], "/%.3f" % r["trans_m"] if r else "", m["seconds"]["total"]))' \
      "$run/summary.json" >"$run/line"
  exit
fi

variants=("$@")
[ $# -gt 0 ] || variants=("${all[@]}")
for variant in "${variants[@]}"; do
  options "$variant" >/dev/null || { echo "unknown variant $variant; known: ${all[*]}" >&2; exit 2; }
done
mkdir -p "$out"
"$mellin" sim -o "$out/sim-offices" --kind offices --seed 3 --odometry poor --spacing 0.4 --beams 361 >/dev/null
"$mellin" sim -o "$out/sim-corridor" --kind corridor --seed 2 --odometry plain --spacing 1.0 --path 900 >/dev/null
logs=()
for kind in offices corridor; do
  cp "$out/sim-$kind/sim-0.log" "$out/$kind.log"
  logs+=("$out/$kind.log $out/sim-$kind/sim-0.tum")
done
data=${MELLIN_DATA:-../shared/data}
if compgen -G "$data/*.log.gz" >/dev/null; then
  for log in "$data"/*.log.gz; do
    relations=${log%.log.gz}.relations
    logs+=("$log ${log%.log.gz}.tum$([ -e "$relations" ] && echo " $relations" || true)")
  done
else
  echo "skipped: no data"
fi
for variant in "${variants[@]}"; do
  printf "$variant %s\n" "${logs[@]}"
done | xargs -P 2 -L 1 tools/ablation.sh --one
printf '%-30s' variant
for log in "${logs[@]}"; do printf ' %-18s' "$(basename "${log%%.log*}")"; done
echo
for variant in "${variants[@]}"; do
  printf '%-30s' "$variant"
  for log in "${logs[@]}"; do printf ' %-18s' "$(cat "$out/$variant-$(basename "${log%%.log*}")/line")"; done
  echo
done
