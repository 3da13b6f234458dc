#!/bin/bash
# check_documents.sh ROOT: what the documents of the project point at is there.
#
#   - each relative link of a *.md file leads to a file or folder, and its #anchor to a heading of that file
#   - each path of the project in backticks exists: `core/phase/phase_law` (a name without its suffix will do),
#     `tests/run.sh --full`, `drivers/ecg/*.cpp`
#   - each key of the configuration in backticks (`phase.law`) is one of config/replay.toml
#   - each file of a folder with an index (README.md) is linked from that index
#   - each folder of the sources that has a header stands in the table of docs/design/targets.md
#   - each document that a comment of the sources names exists
#   - each section of docs/evidence with a table names in one paragraph a commit and a machine of docs/evidence/README.md
#     ("at commit 1a2b3c4 of 2026-11-26, shared"; "2 processors", as make.sh writes, is a machine too; so is "machine was
#     not recorded"), or says "commit not recorded"
#   - between the marks of docs/evidence/make.sh there is a table, and the script knows its name
#   - each commit that a document names is one of the history, where there is one that is whole
#
# What it finds is printed as FILE:LINE: what; exit code 1 then. No network: links to elsewhere are passed over.
set -uo pipefail
root=$(cd "$1" && pwd) || exit 2
cd "$root" || exit 2

faults=0
fault() {
  echo "$1"
  faults=$((faults + 1))
}

mapfile -t documents < <(find . -name '*.md' -not -path './build/*' -not -path './.git/*' -not -path '*/node_modules/*' \
  -not -path './demo-output/*' | sed 's|^\./||' | sort)
if [ ${#documents[@]} -eq 0 ]; then
  echo "$root: no *.md files"
  exit 1
fi

# The anchors that GitHub gives the headings of a file, one a line.
anchors_of() {
  awk '
    /^```/ { code = !code; next }
    !code && /^#+ / {
      sub(/^#+ +/, ""); sub(/ +$/, "")
      # Of a link only its text counts.
      while (match($0, /\[[^]]*\]\([^)]*\)/)) {
        link = substr($0, RSTART, RLENGTH); text = link
        sub(/^\[/, "", text); sub(/\]\(.*$/, "", text)
        $0 = substr($0, 1, RSTART - 1) text substr($0, RSTART + RLENGTH)
      }
      anchor = tolower($0)
      gsub(/[^a-z0-9_ \200-\377-]/, "", anchor)
      gsub(/ /, "-", anchor)
      if (seen[anchor]++) anchor = anchor "-" (seen[anchor] - 1)
      print anchor
    }' "$1"
}

# FILE -> lines "NUMBER<tab>TARGET" of its links and pictures; code is no link.
links_of() {
  awk '
    /^```/ { code = !code; next }
    code { next }
    {
      line = $0
      gsub(/`[^`]*`/, "", line)
      while (match(line, /\]\([^)]*\)/)) {
        print NR "\t" substr(line, RSTART + 2, RLENGTH - 3)
        line = substr(line, RSTART + RLENGTH)
      }
    }' "$1"
}

# FILE -> lines "NUMBER<tab>TEXT" of what stands in backticks outside of code blocks.
quoted_in() {
  awk '
    /^```/ { code = !code; next }
    code { next }
    {
      line = $0
      while (match(line, /`[^`]+`/)) {
        print NR "\t" substr(line, RSTART + 1, RLENGTH - 2)
        line = substr(line, RSTART + RLENGTH)
      }
    }' "$1"
}

# A path of the project exists: as it stands, without its suffix, or as a pattern.
is_there() {
  local path=${1%/}
  [ -e "$path" ] && return 0
  compgen -G "$path" > /dev/null && return 0
  compgen -G "$path.*" > /dev/null
}

# "section.key" of every key, commented out or not.
keys=$(awk '
  /^\[[a-z]+\]$/ { section = substr($0, 2, length($0) - 2) }
  match($0, /^(# )?[a-zA-Z_]+ = /) { key = $0; sub(/^# /, "", key); sub(/ =.*$/, "", key); print section "." key }
' config/replay.toml)
sections=$(sed -n 's/^\[\([a-z]*\)\]$/\1/p' config/replay.toml | paste -sd '|')

for document in "${documents[@]}"; do
  folder=$(dirname "$document")
  while IFS=$'\t' read -r number target; do
    case $target in
      http://* | https://* | mailto:*) continue ;;
    esac
    path=${target%%#*}
    file=$document
    if [ -n "$path" ]; then
      file=$(realpath -m --relative-to=. "$folder/$path")
      if [ ! -e "$file" ]; then
        fault "$document:$number: the link $target leads nowhere"
        continue
      fi
    fi
    if [[ $target == *'#'* && $file == *.md ]] && ! anchors_of "$file" | grep -qxF -- "${target#*#}"; then
      fault "$document:$number: $file has no heading #${target#*#}"
    fi
  done < <(links_of "$document")

  while IFS=$'\t' read -r number text; do
    word=${text%% *}
    word=${word%[,;:]}
    if [[ $word =~ ^(core|drivers|daemon|idl|config|tests|deploy|docs|cmake|\.ci)/[A-Za-z0-9_./*+-]+$ ]]; then
      is_there "$word" || fault "$document:$number: there is no $word"
    elif [[ $text =~ ^($sections)\.([a-z][a-zA-Z_]*)( =.*)?$ ]]; then
      key=${BASH_REMATCH[1]}.${BASH_REMATCH[2]}
      # `recording.mcap` and its like are files.
      [[ $key =~ \.(mcap|toml|csv|cpp|hpp|yaml|md|idl)$ ]] && continue
      grep -qxF "$key" <<< "$keys" || fault "$document:$number: the configuration has no key $key"
    fi
  done < <(quoted_in "$document")
done

# An index that leaves out a file of its folder hides it.
for index in docs/README.md docs/*/README.md; do
  [ -e "$index" ] || continue
  folder=$(dirname "$index")
  targets=$(links_of "$index" | cut -f 2 | sed 's/#.*$//')
  for file in "$folder"/*.md; do
    name=$(basename "$file")
    [ "$name" = README.md ] && continue
    grep -qxF "$name" <<< "$targets" || fault "$index: $name is not linked from here"
  done
done

# The table of targets has every folder of the sources that has a header.
table=docs/design/targets.md
if [ -e $table ]; then
  while read -r folder; do
    grep -qF "| \`$folder\`" $table || grep -qE "^\|.*, \`$folder\`" $table || fault "$table: there is no row for $folder"
  done < <(find core drivers daemon -name '*.hpp' -printf '%h\n' 2> /dev/null | sort -u)
fi

# FILE -> lines "NUMBER<tab>HASH" of what follows the word commit: "commit A", "commits A, B and C".
commits_of() {
  awk '
    function told(   text, word) {
      text = paragraph
      while (match(text, /[Cc]ommits? [0-9a-f]+/)) {
        text = substr(text, RSTART); sub(/^[Cc]ommits? /, "", text)
        while (match(text, /^[0-9a-f]+/)) {
          word = substr(text, 1, RLENGTH); text = substr(text, RLENGTH + 1)
          if (length(word) >= 7) print first "\t" word
          if (!sub(/^(, and |, | and )/, "", text)) break
        }
      }
      paragraph = ""
    }
    /^```/ { code = !code; told(); next }
    code { next }
    /^[ \t]*$/ { told(); next }
    { if (paragraph == "") first = NR; sub(/^ +/, ""); paragraph = paragraph (paragraph == "" ? "" : " ") $0 }
    END { told() }' "$1"
}

# Figures without commit and machine cannot be made again. The first column of the index' table has the machines.
machines=$(sed -n '/^## Machines/,/^## [^M]/s/^| \([a-z]*\) |.*/\1/p' docs/evidence/README.md 2> /dev/null | grep -vx name | paste -sd '|')
for page in docs/evidence/*.md; do
  [ -e "$page" ] && [ "$page" != docs/evidence/README.md ] || continue
  while IFS=$'\t' read -r number heading; do
    fault "$page:$number: the section \"$heading\" has a table, and names no commit with its machine"
  done < <(awk -v machine="(^|[^a-z])(${machines:-no machine}|[0-9]+ processors|machine was not recorded)([^a-z]|\$)" '
    function paragraph_ends() {
      if (paragraph ~ /[Cc]ommits? [0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f][0-9a-f]/ && paragraph ~ machine) told = 1
      if (paragraph ~ /commit not recorded/) told = 1
      paragraph = ""
    }
    function section_ends() {
      paragraph_ends()
      if (table && !told) print first "\t" heading
      table = told = 0
    }
    /^```/ { code = !code; next }
    code { next }
    /^#+ / { section_ends(); first = NR; heading = $0; sub(/^#+ /, "", heading); next }
    /^[ \t]*$/ { paragraph_ends(); next }
    /^ *\|/ { table = 1; next }
    { sub(/^ +/, ""); paragraph = paragraph (paragraph == "" ? "" : " ") $0 }
    END { section_ends() }' "$page")
done

# Between marks that hold nothing nobody sees that a table is missing.
for page in docs/evidence/*.md; do
  [ -e "$page" ] || continue
  while IFS=$'\t' read -r number name filled; do
    [ "$filled" = yes ] || fault "$page:$number: there is no table between the marks of $name"
    [ ! -e docs/evidence/make.sh ] || bash docs/evidence/make.sh --list | grep -q "^$name " ||
      fault "$page:$number: docs/evidence/make.sh makes no $name"
  done < <(awk '
    /^<!-- made: .* -->$/ { name = $3; first = NR; filled = "no"; next }
    name != "" && /^(\||```)/ { filled = "yes" }
    /^<!-- end: .* -->$/ { print first "\t" name "\t" filled; name = "" }' "$page")
done

# A clone that is not whole lacks old commits, and a release has no history at all.
history="no history here to look commits up in"
if [ "$(git rev-parse --show-toplevel 2> /dev/null)" = "$(pwd -P)" ] && [ "$(git rev-parse --is-shallow-repository)" = false ]; then
  looked_up=0
  commits=$(git rev-list HEAD)
  for document in "${documents[@]}"; do
    while IFS=$'\t' read -r number hash; do
      looked_up=$((looked_up + 1))
      grep -q "^$hash" <<< "$commits" || fault "$document:$number: the history has no commit $hash"
    done < <(commits_of "$document")
  done
  history="$looked_up times a commit of the history"
fi

# Not idl/: its text, comments included, is part of every recording, so it changes with its next version alone.
while IFS=: read -r file number name; do
  [ -e "$name" ] || fault "$file:$number: there is no $name"
done < <(grep -rnoE --include='*.[ch]pp' --include='*.sh' --include='CMakeLists.txt' --include='*.cmake' --include='*.toml' \
  '\bdocs/[a-zA-Z0-9_/-]+\.md\b' core drivers daemon tests deploy config cmake 2> /dev/null | grep -v '^tests/docs/')

if [ $faults -gt 0 ]; then
  echo "$faults faults in ${#documents[@]} documents"
  exit 1
fi
echo "${#documents[@]} documents: every link, path and key is there; $history"
