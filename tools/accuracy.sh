#!/usr/bin/env bash
# Maps the real logs with one configuration and scores them: a line a run. Entropy: of the map of the scans that the
# truth has poses for, as a share of the entropy of the same scans' map at the true poses (mellin entropy).
# usage: tools/accuracy.sh [MAP OPTION…]      e.g. tools/accuracy.sh --no-loops, or --set mapper.particles=10 --seed 2
# Logs: $MELLIN_DATA, else ../shared/data: NAME.log.gz, NAME.tum and, where there is one, NAME.relations.
set -euo pipefail
cd "$(dirname "$0")/.."
data=${MELLIN_DATA:-../shared/data}
mellin=build/host/bin/mellin
out=build/accuracy
compgen -G "$data/*.log.gz" >/dev/null || { echo "skipped: no data"; exit 0; }
for log in "$data"/*.log.gz; do
  name=$(basename "$log" .log.gz)
  "$mellin" map "$log" -o "$out/$name" "$@" >/dev/null
  relations=()
  [ -e "$data/$name.relations" ] && relations=(--relations "$data/$name.relations")
  "$mellin" entropy "$log" "$out/$name/trajectory-0.tum" --against "$data/$name.tum" --json >"$out/$name/entropy.json"
  "$mellin" score "$out/$name/trajectory-0.tum" "$data/$name.tum" "${relations[@]}" --json |
    python3 -c '
import json, sys
s, m, e = json.load(sys.stdin), json.load(open(sys.argv[2])), json.load(open(sys.argv[3]))
r = s.get("relations")
print("%-6s ATE %.3f m (max %.2f)  step %.3f m  revisit %.3f m  relations %s  entropy %.3f (a cell %.3f)  loops %d  %.1f s, RSS %d MB, heap %d" % (
    sys.argv[1], s["ate_rmse_m"], s["ate_max_m"], s["rel_step_m"], s.get("rel_revisit_m", 0),
    "%.3f +- %.3f m" % (r["trans_m"], r["trans_std_m"]) if r else "none", e["entropy_ratio"], e["bits_per_cell_ratio"],
    m["edges"]["loop"], m["seconds"]["total"],
    m["memory"]["peak_rss_bytes"] >> 20, m["memory"]["heap_allocations_after_init"]))' "$name" "$out/$name/summary.json" \
      "$out/$name/entropy.json"
done
