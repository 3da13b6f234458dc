#!/bin/sh
# perimap(1): the template, and in the place of its line @COMMANDS@ each command with its options, as the program itself
# tells them with --help, so that page and program cannot disagree.
#   perimap_page.sh PERIMAP TEMPLATE > perimap.1
set -eu
perimap=$1
template=$2

commands_of() { # COMMAND...: those that its help names
  "$perimap" "$@" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z0-9-]*\) .*/\1/p'
}

describe() { # COMMAND...
  "$perimap" "$@" --help | awk -v name="perimap $*" '
    function roff(text) {
      gsub(/\\/, "\\e", text)
      gsub(/-/, "\\-", text)
      sub(/^[.\47]/, "\\\\\\&&", text)
      return text
    }
    BEGIN { print ".SS " roff(name) }
    /^Usage: / { sub(/^Usage: /, ""); print ".PP\n.B " roff($0) "\n.PP"; described = 1; next }
    /^[A-Z][A-Za-z ]*:$/ { section = $0; next }
    /^\[Option Group: / { section = $0; next }
    section == "Subcommands:" { if ($0 == "") section = ""; next }
    /^$/ { next }
    /^ +[^ ].*/ && section != "" {
      indent = match($0, /[^ ]/) - 1
      text = substr($0, indent + 1)
      if (indent > 10) { print roff(text); next }
      cut = match(text, /   *[^ ]/)
      print ".TP\n.B " roff(cut ? substr(text, 1, cut - 1) : text)
      if (cut) { text = substr(text, cut); sub(/^ +/, "", text); print roff(text) }
      next
    }
    { if (described && section != "") { print ".PP"; section = "" } print roff($0) }'
  for inner in $(commands_of "$@"); do describe "$@" "$inner"; done
}

sed '/^@COMMANDS@$/,$d' "$template"
for command in $(commands_of); do describe "$command"; done
sed '1,/^@COMMANDS@$/d' "$template"
