#!/bin/bash
# The man pages and the completion know what the programs know.
# pages.sh PERIMAP BUILD_FOLDER SOURCE_FOLDER
set -uo pipefail
perimap=$1 build=$2 source=$3

fail() {
  echo "FAILED: $1"
  exit 1
}
commands() { sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p'; }
[ "$("$perimap" --help | commands | wc -l)" -gt 5 ] || fail "the help names no commands"
for command in $("$perimap" --help | commands); do
  grep -q "^\.B $command\$" "$build/deploy/perimap.1" || fail "perimap(1) does not know $command"
done
for key in $(grep -oE '^(# )?[a-zA-Z_]+ =' "$source/config/replay.toml" | grep -oE '[a-zA-Z_]+'); do
  grep -q "^\.B $key = " "$build/deploy/perimapd.toml.5" || fail "perimapd.toml(5) does not know $key"
done
grep -q '^\.SH \[realtime\]' "$build/deploy/perimapd.toml.5" || fail "perimapd.toml(5) has no sections"

# shellcheck source=/dev/null
. "$source/deploy/completion/perimap"
PATH="$(dirname "$perimap"):$PATH"
completes() { # EXPECTED WORD...: the last word is completed
  local expected=$1
  shift
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
  _perimap 2> /dev/null
  printf '%s\n' "${COMPREPLY[@]}" | grep -qx -e "$expected" || fail "'$*' does not come to $expected: ${COMPREPLY[*]}"
}
completes simulate perimap sim
completes --duration perimap simulate --dur
completes new-patient perimap ctl new
echo "as promised"
