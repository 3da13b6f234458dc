#!/bin/bash
# The man pages and the completion know what the programs know.
# pages.sh PERIMAP BUILD_FOLDER SOURCE_FOLDER
set -uo pipefail
perimap=$1 build=$2 source=$3

fail() {
  echo "FAILED: $1"
  exit 1
}
commands() { sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z0-9-]*\) .*/\1/p'; }
[ "$("$perimap" --help | commands | wc -l)" -gt 5 ] || fail "the help names no commands"
# Every command's help, its option names, and what man(1) shows of the page for it.
every_command() { # COMMAND...
  local inner
  for inner in $("$perimap" "$@" --help | commands); do
    echo "$* $inner"
    every_command "$@" "$inner"
  done
}
options() { grep -oE '^ +(-[a-zA-Z],)?--[a-z][a-z0-9-]*' | grep -oE -e '--[a-z0-9-]+' | sort; }
every_command | grep -x 'bridge ros2' > /dev/null || fail "a command with a digit in its name is passed over"
sed 's/\\-/-/g' "$build/deploy/perimap.1" > "$build/deploy/perimap.1.plain"
while read -r -a command; do
  told=$("$perimap" "${command[@]}" --help | options)
  [ -n "$told" ] || fail "${command[*]} --help names no options"
  shown=$(sed -n "/^\.SS perimap ${command[*]}\$/,/^\.S[SH] /p" "$build/deploy/perimap.1.plain" | tail -n +2 |
    sed -n 's/^\.B /  /p' | options)
  [ "$told" = "$shown" ] || fail "perimap(1) on ${command[*]}: $(diff <(echo "$told") <(echo "$shown"))"
done < <(every_command)
perimapd=$(dirname "$perimap")/perimapd
[ "$("$perimapd" --help | options)" = "$(sed -n '/^\.SH OPTIONS$/,/^\.SH /s/\\-/-/gp' "$build/deploy/perimapd.8" |
  grep -E '^\.B' | grep -oE -e '--[a-z0-9-]+' | sort)" ] || fail "perimapd(8) has other options than perimapd --help"
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
# OPTION WORDS, a line for each option whose value is one of some words
values() { sed -nE 's/^ +(-[a-zA-Z],)?(--[a-z0-9-]+) TEXT:\{([^}]*)\}.*/\2 \3/p'; }
of_some_words=0
while read -r -a command; do
  while read -r option words; do
    of_some_words=$((of_some_words + 1))
    COMP_WORDS=(perimap "${command[@]}" "$option" '') COMP_CWORD=$((${#command[@]} + 2)) COMPREPLY=()
    _perimap 2> /dev/null
    diff <(tr , '\n' <<< "$words" | sort) <(printf '%s\n' "${COMPREPLY[@]}" | sort) ||
      fail "completion of 'perimap ${command[*]} $option'"
  done < <("$perimap" "${command[@]}" --help | values)
done < <(every_command)
[ $of_some_words -ge 10 ] || fail "only $of_some_words options are one of some words"
completes fisheye perimap calibrate camera --lens fi
completes fisheye perimap calibrate camera --lens = fi
completes brown-conrady perimap calibrate camera --lens =
completes live,ddsperf perimap bench --only live,dd
completes ros2 perimap bridge r
cd "$source" || exit 1
completes README.md perimap bench --html READ
completes README.md perimap bench -c READ
completes README.md perimap bench --security READ
completes README.md perimap bench READ
COMP_WORDS=(perimap bench --runs '') COMP_CWORD=3 COMPREPLY=()
_perimap 2> /dev/null
[ ${#COMPREPLY[@]} -eq 0 ] || fail "a number is completed by ${COMPREPLY[*]}"
COMP_WORDS=(perimapd --) COMP_CWORD=1 COMPREPLY=()
_perimapd 2> /dev/null
diff <("$perimapd" --help | options) <(printf '%s\n' "${COMPREPLY[@]}" | sort) || fail "completion of 'perimapd --'"
completes simulate perimap sim
completes --duration perimap simulate --dur
completes new-patient perimap ctl new
completes on perimap ctl record o
completes off perimap ctl --socket /run/other record ''
completes --json perimap ctl status --
completes --socket perimap ctl --
echo "as promised"
