#!/bin/bash
# commands_in_documents.sh PERIMAP ROOT: each perimap command in a block of commands of README.md and docs/guide is one,
# and the options that it is given there are options of it. Lines that end with a backslash go on in the next.
#
# What it finds is printed as FILE: COMMAND: what; exit code 1 then.
set -uo pipefail
perimap=$1
cd "$2" || exit 2

faults=0
commands=0
declare -A help  # of each command, once
fault() {
  echo "$1"
  faults=$((faults + 1))
}

# commands_of FILE: its perimap commands, one a line; options of `perimap simulate` that are another's value as one more
commands_of() {
  awk '
    /^```/ { code = !code; next }
    !code { next }
    { line = line $0 }
    /\\$/ { sub(/\\$/, " ", line); next }
    { print line; line = "" }' "$1" | sed 's/[ \t]#.*//; s/^\$ //' | grep -oE '^(sudo )?([^ ]*/)?perimap .*' | sed -E 's/^(sudo )?[^ ]*perimap /perimap /; s/ --simulated "([^"]*)"(.*)/ --simulated OPTIONS\2\nperimap simulate \1/'
}

for file in README.md docs/guide/*.md; do
  while IFS= read -r line; do
    read -ra words <<< "$line"
    # The command has one word, or two where the first is a group.
    name=${words[1]}
    case $name in
      bridge | calibrate | keys | ctl) [[ ${words[2]:-} == [a-z]* ]] && name+=" ${words[2]}" ;;
    esac
    commands=$((commands + 1))
    if [ -z "${help[$name]:-}" ]; then
      # shellcheck disable=SC2086
      help[$name]=$("$perimap" $name --help 2>&1)
      # Of a word that is no command the help is that of what stands before it.
      grep -q "^Usage: perimap $name " <<< "${help[$name]} " || fault "$file: perimap $name: is no command"
    fi
    for word in "${words[@]:2}"; do
      [[ $word == --[a-z]* ]] || continue
      option=${word%%=*}
      grep -qE -- "^ +(-[a-zA-Z],)?$option([ ,=]|\$)" <<< "${help[$name]}" || fault "$file: perimap $name: $option is no option of it"
    done
  done < <(commands_of "$file")
done
# Nothing found is nothing looked at.
[ $commands -ge 40 ] || fault "only $commands commands were found in the documents"
echo "$commands commands, $faults faults"
[ $faults -eq 0 ]
