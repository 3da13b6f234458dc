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
# Every command's help, its option names, and what man(1) shows of the page for it.
every_command() { # COMMAND...
  local inner
  for inner in $("$perimap" "$@" --help | commands); do
    echo "$* $inner"
    every_command "$@" "$inner"
  done
}
options() { grep -oE '^ +(-[a-zA-Z],)?--[a-z][a-z-]*' | grep -oE -e '--[a-z-]+' | sort; }
sed 's/\\-/-/g' "$build/deploy/perimap.1" > "$build/deploy/perimap.1.plain"
while read -r -a command; do
  told=$("$perimap" "${command[@]}" --help | options)
  [ -n "$told" ] || fail "${command[*]} --help names no options"
  shown=$(sed -n "/^\.SS perimap ${command[*]}\$/,/^\.S[SH] /p" "$build/deploy/perimap.1.plain" | tail -n +2 |
    sed -n 's/^\.B /  /p' | options)
  [ "$told" = "$shown" ] || fail "perimap(1) on ${command[*]}: $(diff <(echo "$told") <(echo "$shown"))"
done < <(every_command)
# Sections, keys with their defaults, and below each key the whole of its comment.
in_the_configuration() {
  awk '/^\[/ { print }
       /^(# )?[a-zA-Z_]+ =/ { sub(/^# /, ""); print $0 meaning; meaning = ""; next }
       /^# / { meaning = meaning "\n" substr($0, 3) }
       /^$/ { meaning = "" }' "$source/config/replay.toml"
}
on_the_page() {
  sed -n -e '/^\.TP$/,/^\.SH SEE/{/^\.TP$/d; /^\.SH SEE/d; s/^\.SH //; s/^\.B //; s/\\-/-/g; s/\\e/\\/g; p}' \
    "$build/deploy/perimapd.toml.5"
}
[ "$(in_the_configuration | grep -c ' = ')" -gt 50 ] || fail "config/replay.toml has no keys"
diff <(in_the_configuration) <(on_the_page) || fail "perimapd.toml(5) is not what config/replay.toml says"

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
# What the help names is completed, and nothing else.
while read -r -a command; do
  COMP_WORDS=(perimap "${command[@]}" --) COMP_CWORD=$((${#command[@]} + 1)) COMPREPLY=()
  _perimap 2> /dev/null
  diff <("$perimap" "${command[@]}" --help | options) <(printf '%s\n' "${COMPREPLY[@]}" | sort) ||
    fail "completion of 'perimap ${command[*]} --'"
done < <(every_command)
completes simulate perimap sim
completes --duration perimap simulate --dur
completes new-patient perimap ctl new
completes on perimap ctl record o
completes off perimap ctl --socket /run/other record ''
completes --json perimap ctl status --
completes --socket perimap ctl --
echo "as promised"
