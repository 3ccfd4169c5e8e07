#!/usr/bin/env bash
# The paper's evaluation (Section V) on the real logs and on simulated buildings that change: tables, curves and pictures
# under build/eval. Takes an hour on one core and is no part of the tests.
# usage: tools/eval.sh [EVAL OPTION…]      e.g. tools/eval.sh --threads 2, or --full (all pairs at full resolution: a day)
# Logs: $MELLIN_DATA, else ../shared/data: NAME.log.gz and NAME.tum. intel comes first: thresholds chosen on it are held
# on the others.
set -euo pipefail
cd "$(dirname "$0")/.."
data=${MELLIN_DATA:-../shared/data}
mellin=build/host/bin/mellin
out=build/eval
logs=()
for name in intel fr079 aces; do
  [ -e "$data/$name.log.gz" ] && logs+=("$data/$name.log.gz")
done
if [ ${#logs[@]} -eq 0 ]; then
  echo "skipped: no data"
else
  # Figs. 3 to 5 in random orientation, the honest one; Fig. 5 with axes aligned as well.
  "$mellin" eval screening "${logs[@]}" -o "$out/screening" "$@"
  "$mellin" eval screening "${logs[@]}" -o "$out/screening-aligned" --frames aligned --figures 5 "$@"
  # Figs. 6 and 7, and the library's whole registration.
  "$mellin" eval registration "${logs[@]}" -o "$out/registration" "$@"
  "$mellin" eval registration "${logs[@]}" -o "$out/registration-aligned" --frames aligned --figures pipeline "$@"
  # What each stage of screening drops and keeps.
  for log in "${logs[@]}"; do
    "$mellin" eval cascade "$log" -o "$out/cascade/$(basename "$log" .log.gz)"
  done
  # The probability of a pose, fitted on intel, aces and a simulated building, judged on fr079 and another one.
  if [ ${#logs[@]} -eq 3 ]; then
    for seed in 1 2; do
      "$mellin" sim --kind offices --seed "$seed" -o "$out/offices$seed"
    done
    "$mellin" eval confidence "${logs[0]}" "${logs[2]}" "$out/offices2/sim-0.log" "${logs[1]}" "$out/offices1/sim-0.log" \
      --fit 3 -o "$out/confidence" "$@"
  fi
fi
"$mellin" eval change -o "$out/change"
"$mellin" eval runtime -o "$out/runtime"
