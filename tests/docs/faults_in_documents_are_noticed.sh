#!/bin/bash
# faults_in_documents_are_noticed.sh: a folder of documents without a fault passes check_documents.sh, and each kind of
# fault alone is noticed at its line.
set -uo pipefail
check=$(cd "$(dirname "$0")" && pwd)/check_documents.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
status=0

fresh() {
  rm -rf "$work/tree"
  mkdir -p "$work/tree/docs/room" "$work/tree/core/phase" "$work/tree/config"
  cd "$work/tree" || exit 2
  printf '[phase]\n# how\nlaw = "auto"\n# other = 1\n' > config/replay.toml
  touch core/phase/phase_law.hpp
  printf '# The room\n\n## A `heading`, twice\n\n## A heading, twice\n' > docs/room/page.md
  printf '# Index\n\n[page](page.md)\n' > docs/room/README.md
  cat > README.md << 'END'
# Title

[page](docs/room/page.md), [its heading](docs/room/page.md#a-heading-twice), [the other](docs/room/page.md#a-heading-twice-1),
[here](#title), [elsewhere](https://example.org/nowhere), `core/phase/phase_law`, `core/phase/*.hpp`, `phase.law = "auto"`,
`phase.other`, `[not a link](nowhere.md)`

```sh
ls [neither](nowhere.md) `core/nowhere`
```
END
}

fresh
if ! bash "$check" . > out 2>&1; then
  echo "FAILED: documents without a fault are refused:"
  cat out
  status=1
fi

noticed() { # TEXT EXPECTED: with the text as the last line of README.md
  fresh
  printf '\n%s\n' "$1" >> README.md
  local line
  line=$(wc -l < README.md)
  if bash "$check" . > out 2>&1; then
    echo "FAILED: not noticed: $1"
    status=1
  elif ! grep -qF "README.md:$line: $2" out; then
    echo "FAILED: expected 'README.md:$line: $2' of '$1', got:"
    cat out
    status=1
  fi
}
noticed '[gone](docs/gone.md)' 'the link docs/gone.md leads nowhere'
noticed '![picture](docs/gone.png)' 'the link docs/gone.png leads nowhere'
noticed '[gone](docs/room/page.md#gone)' 'docs/room/page.md has no heading #gone'
noticed '[gone](#gone)' 'README.md has no heading #gone'
noticed 'see `core/phase/gone`' 'there is no core/phase/gone'
noticed 'run `tests/gone.sh --full`' 'there is no tests/gone.sh'
noticed 'set `phase.gone`' 'the configuration has no key phase.gone'
noticed 'set `phase.gone = 3`' 'the configuration has no key phase.gone'

fresh
printf '\n// see docs/room/gone.md\n// and docs/room/page.md\n' > core/phase/phase_law.hpp
if bash "$check" . > out 2>&1 || ! grep -qF 'core/phase/phase_law.hpp:2: there is no docs/room/gone.md' out ||
  grep -qF 'page.md' out; then
  echo "FAILED: a comment that names a document which is not there is not noticed:"
  cat out
  status=1
fi

fresh
touch docs/room/hidden.md
if bash "$check" . > out 2>&1 || ! grep -qF 'docs/room/README.md: hidden.md is not linked from here' out; then
  echo "FAILED: a page that its index leaves out is not noticed:"
  cat out
  status=1
fi

fresh
mkdir -p docs/design core/time
touch core/time/instant.hpp
printf '# Targets\n\n| target |\n|---|\n| `core/time` |\n' > docs/design/targets.md
if bash "$check" . > out 2>&1 || ! grep -qF 'docs/design/targets.md: there is no row for core/phase' out ||
  grep -qF 'core/time' out; then
  echo "FAILED: a folder without a row in the table of targets is not noticed:"
  cat out
  status=1
fi
# evidence TEXT...: a page of evidence whose second section has a table, and then these lines.
evidence() {
  fresh
  mkdir -p docs/evidence
  printf '# Evidence\n\n[page](page.md)\n\n## Machines\n\n| name | what |\n|---|---|\n| quick | one |\n' > docs/evidence/README.md
  printf '# Page\n\nNo table.\n\n## Figures\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n' > docs/evidence/page.md
  printf '%s\n' "$@" '' '## No figures' '' 'At commit 1234567, quick.' >> docs/evidence/page.md
}
told=('At commit 1234567 of 2026-11-26, quick.'
  'By commits 89abcde and
1234567: 2 processors.'
  'At commit 1234567; the machine was not recorded.'
  'By hand; commit not recorded.')
for text in "${told[@]}"; do
  evidence "$text"
  if ! bash "$check" . > out 2>&1; then
    echo "FAILED: a section of the evidence that says '$text' is refused:"
    cat out
    status=1
  fi
done
untold=('Measured.' 'Measured, quick.' 'At commit 1234567.' 'At commit 1234567, quicker.' $'At commit 1234567.\n\nOn quick.' 'At commit 12345, quick.')
for text in "${untold[@]}"; do
  evidence "$text"
  if bash "$check" . > out 2>&1 ||
    ! grep -qF 'docs/evidence/page.md:5: the section "Figures" has a table, and names no commit with its machine' out; then
    echo "FAILED: a section of the evidence that says '$text' is not noticed:"
    cat out
    status=1
  fi
done

# Marks of make.sh with nothing between them, and a name that the script does not know.
evidence 'At commit 1234567, quick.' '<!-- made: speed -->' '' 'No table.' '<!-- end: speed -->'
line=$(grep -n '^<!-- made: speed' docs/evidence/page.md | cut -d : -f 1)
if bash "$check" . > out 2>&1 || ! grep -qF "docs/evidence/page.md:$line: there is no table between the marks of speed" out; then
  echo "FAILED: marks with nothing between them are not noticed:"
  cat out
  status=1
fi
evidence 'At commit 1234567, quick.' '<!-- made: speed -->' '| a |' '|---|' '| 1 |' '<!-- end: speed -->'
printf 'echo "speed 1 minute"\n' > docs/evidence/make.sh
if ! bash "$check" . > out 2>&1; then
  echo "FAILED: a table between marks is refused:"
  cat out
  status=1
fi
printf 'echo "speeds 1 minute"\n' > docs/evidence/make.sh
if bash "$check" . > out 2>&1 || ! grep -qF "docs/evidence/page.md:$line: docs/evidence/make.sh makes no speed" out; then
  echo "FAILED: marks of a table that the script does not make are not noticed:"
  cat out
  status=1
fi

# With a history: its commits are known, others are not.
fresh
git init -q . && git -c user.name=Nobody -c user.email=nobody@example.org -c commit.gpgsign=false commit -q --allow-empty -m First
known=$(git rev-parse --short=7 HEAD)
printf '\nAt commit %s, at commits %s and\n%s.\n' "$known" "$known" "$known" >> README.md
if ! bash "$check" . > out 2>&1 || ! grep -qF '3 times a commit of the history' out; then
  echo "FAILED: commits of the history are refused, or are not looked up:"
  cat out
  status=1
fi
printf '\nAt commits %s and 0123456.\n' "$known" >> README.md
line=$(wc -l < README.md)
if bash "$check" . > out 2>&1 || ! grep -qF "README.md:$line: the history has no commit 0123456" out; then
  echo "FAILED: a commit that the history does not have is not noticed:"
  cat out
  status=1
fi
exit $status
