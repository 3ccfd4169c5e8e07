# For sourcing.   fence FILE HEADING LANGUAGE: the lines of the first such code fence under "## HEADING" of a Markdown
# file; fails, saying so, where there is none.
fence() {
  awk -v heading="## $2" -v open="\`\`\`$3" '
    inside && /^```/ {exit}
    inside {print; found = 1; next}
    /^## / {section = ($0 == heading)}
    section && $0 == open {inside = 1}
    END {exit !found}' "$1" || { echo "no \`\`\`$3 fence under \"## $2\" in $1" >&2; return 1; }
}
