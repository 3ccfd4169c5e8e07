#!/usr/bin/env bash
# Maps simulated buildings of several kinds, with several odometries and scan spacings, and scores them against the
# exact truth: a line a run, then the share with an ATE below 0.10 m and the names of the others.
# usage: tools/robust.sh [--faults] [MAP OPTION…]    e.g. tools/robust.sh --profile micro
#   --faults: instead of the odometries, what befalls a robot and its sensor (people, glass, missing beams, stops,
#             pushes, slips, kidnaps), in the offices and on the ring
# Environment: KINDS ("offices hall corridor flat cave"; with --faults "offices ring"), SEEDS ("1 2 3 4"; with --faults
# "1"), FAULTS ("none people glass missing stops pushes slips kidnaps", with --faults).
# MELLIN is the program (build/host/bin/mellin). Results: build/robust/NAME (log and truth in its folder sim). Two runs at
# a time.
set -euo pipefail
cd "$(dirname "$0")/.."

# One run: robust.sh --one NAME KIND SEED ODOMETRY "SIM OPTIONS" [MAP OPTION…]
run_one() {
  local name=$1 kind=$2 seed=$3 odometry=$4 options=$5
  shift 5
  local mellin=${MELLIN-build/host/bin/mellin} out=build/robust/$name
  mkdir -p "$out"
  # shellcheck disable=SC2086  # the options are words
  "$mellin" sim -o "$out/sim" --kind "$kind" --seed "$seed" --odometry "$odometry" $options >/dev/null
  "$mellin" map "$out/sim/sim-0.log" -o "$out" "$@" >/dev/null 2>"$out/errors"
  for trajectory in trajectory live; do
    "$mellin" score "$out/$trajectory-0.tum" "$out/sim/sim-0.tum" --json >"$out/$trajectory.json"
  done
  python3 - "$name" "$odometry" "$options" "$out" <<'PYTHON' >"$out/line"
import json, math, sys
name, odometry, options, out = sys.argv[1:]
load = lambda file: json.load(open(f"{out}/{file}.json"))
final, live, summary = load("trajectory"), load("live"), load("summary")
truth = [tuple(map(float, line.split())) for line in open(f"{out}/sim/sim-0.tum")]
truth = [(t[1], t[2], 2 * math.atan2(t[6], t[7])) for t in truth]
words = [line.split() for line in open(f"{out}/sim/sim-0.log") if line.startswith("FLASER")]
wheels = [tuple(map(float, w[-9:-6])) for w in words]
path = sum(math.dist(a[:2], b[:2]) for a, b in zip(truth, truth[1:]))
def seen_from_first(poses):
    (x0, y0, t0), (x, y, _) = poses[0], poses[-1]
    c, s = math.cos(t0), math.sin(t0)
    return c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0)
end = math.dist(seen_from_first(truth), seen_from_first(wheels))
print("%-18s %-8s path %5.0f m  odometry's end %6.1f m  ATE %7.3f m  live %7.3f m  poses %3.0f %%  loops %4d  "
      "components %2d  %5.1f s  %s" % (name, odometry, path, end, final["ate_rmse_m"], live["ate_rmse_m"],
      100 * final["paired"], summary["edges"]["loop"], summary["components"], summary["seconds"]["total"], options))
PYTHON
  cat "$out/line"
}

if [ "${1-}" = --one ]; then
  shift
  run_one "$@"
  exit
fi

faults=no
[ "${1-}" = --faults ] && { faults=yes; shift; }
runs=()  # NAME KIND SEED ODOMETRY OPTIONS, five a run
if [ $faults = no ]; then
  odometries=(good plain poor slipping)
  spacings=(0.1 0.2 0.4 0.7 1.0)
  beams=(180 181 360 361)
  declare -A place=([offices]=0 [hall]=1 [corridor]=2 [flat]=3 [cave]=4 [ring]=5)
  for kind in ${KINDS-offices hall corridor flat cave}; do
    for seed in ${SEEDS-1 2 3 4}; do
      # A kind and a seed are always the same run. 5 spacings and 4 odometries have no common factor, so that over the
      # kinds they meet in all pairs.
      at=$((4 * place[$kind] + seed - 1))
      runs+=("$kind-$seed" "$kind" "$seed" "${odometries[(seed - 1) % 4]}"
        "--spacing ${spacings[at % 5]} --beams ${beams[(place[$kind] + seed) % 4]}")
    done
  done
else
  declare -A options=([none]="" [people]="--people 3" [glass]="--glass 0.3" [missing]="--missing 0.2"
    [stops]="--stops 3 --people 2" [pushes]="--pushes 3" [slips]="--slips 5" [kidnaps]="--kidnaps 1")
  for kind in ${KINDS-offices ring}; do
    for seed in ${SEEDS-1}; do
      for fault in ${FAULTS-none people glass missing stops pushes slips kidnaps}; do
        runs+=("$kind-$seed-$fault" "$kind" "$seed" plain "${options[$fault]}")
      done
    done
  done
fi

names=()
for ((i = 0; i < ${#runs[@]}; i += 5)); do
  names+=("${runs[i]}")
done
jobs=0
for ((i = 0; i < ${#runs[@]}; i += 5)); do
  { "$0" --one "${runs[@]:i:5}" "$@" || echo "${runs[i]} FAILED" | tee "build/robust/${runs[i]}/line"; } &
  jobs=$((jobs + 1))
  if [ $jobs -ge 2 ]; then
    wait -n
    jobs=$((jobs - 1))
  fi
done
wait
echo
for name in "${names[@]}"; do
  cat "build/robust/$name/line"
done | python3 -c '
import re, sys
lines = sys.stdin.read().splitlines()
ate = {line.split()[0]: float((re.search(r"ATE +([0-9.]+)", line) or [0, "inf"])[1]) for line in lines}
bad = [name for name in ate if not ate[name] < 0.10]
print("%d of %d runs below 0.10 m (%.0f %%)" % (len(ate) - len(bad), len(ate), 100.0 * (1 - len(bad) / len(ate))))
print("others: " + (", ".join("%s (%.2f m)" % (name, ate[name]) for name in bad) or "none"))'
