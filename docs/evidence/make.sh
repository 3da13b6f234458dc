#!/bin/bash
# Measures anew what a command can measure, and writes the tables of docs/evidence.
#
# A table that this script makes stands in its page between two lines:
#     <!-- made: NAME -->
#     <!-- end: NAME -->
# What lies between them is replaced by the table, and by a line that says by which command, commit and machine it was
# made. Everything else in the pages is written by hand. A table without such lines in any page is printed.
set -uo pipefail
cd "$(dirname "$0")/../.."

usage() {
  cat << 'END'
docs/evidence/make.sh [--build FOLDER] [--keep FOLDER] [--records FOLDER] [--list] [NAME...]
  Runs the commands of the tables NAME (all of them when none is named) and writes the tables into docs/evidence/*.md.
  A table that has no place in a page (setups, setups-noise, latency: their pages put several runs beside each other)
  is printed.
  --build  where the programs are: build/release (the default) or another preset's folder. The release preset leaves the
           tests out, and with them the programs of most tables:
             cmake --preset release -DPERIMAP_TESTS=all
             cmake --build --preset release --target perimap statistics statistics_ecg statistics_setups \
               statistics_watched_setups update_bench vision_bench
  --keep   keeps recordings and reports in FOLDER; without it they go when the script ends
  --records  records of the MIT-BIH Arrhythmia Database, as statistics_ecg --help says; tables that need them are left
             out without it, unless they are named
  --list   prints the names, with about how long each takes on two cores that do nothing else
Exit code 0 when all were made, 1 when one failed, 2 for a wrong command line.
END
}

# NAME  ABOUT
list() {
  cat << 'END'
experiment-1    1 minute    the paper's first experiment
experiment-2    1 minute    the paper's second experiment
displayed       3 minutes   what is displayed, 0, 100 and 300 ms ahead
image           9 minutes   what the image brings beside the ECG alone, by rhythm and law
breathing       7 minutes   breathing of 10 mm, on and off
slow-tracker    4 minutes   a tracker whose errors are slow, told and not told
precision       3 minutes   the map in single precision
lost            5 minutes   statistics --long lost
optimal        10 minutes   statistics --long optimal
breath          5 minutes   statistics --long breath
harmonics       5 minutes   statistics --long harmonics
drift           5 minutes   statistics --long drift
pose           30 minutes   statistics --long pose
ecg            20 minutes   statistics --long ecg
ecg-made        2 minutes   statistics_ecg made: leads that are drawn
ecg-paced       1 minute    statistics_ecg paced: paced leads with ventricular beats
ecg-records     1 minute    statistics_ecg records peak-times ventricular prediction starts, of --records
ecg-disturbed   1 minute    statistics_ecg disturbed, of --records
ecg-two-leads   2 minutes   statistics_ecg two-leads, of --records
horizons       30 minutes   statistics --long horizons
late            5 minutes   statistics --long late
ventilated     20 minutes   statistics --long ventilated
setups         15 minutes   statistics_setups: 50 set-ups drawn at random, measured
setups-noise    5 minutes   statistics_setups: tips of tools and noise of trackers, 200 of each
watched-setups  2 minutes   statistics_watched_setups: what the watch says of right and wrong set-ups
watched-lies   15 minutes   what the watch says in sessions whose set-up is wrong
watched-truth  20 minutes   what it says in sessions whose set-up is right
lies            2 hours     sessions that are lied to, by set-ups and devices that are wrong, of three drawn seeds
procedures      2 hours     procedures that are written and drawn: available, wrong, alarmed, told
update         10 minutes   update_bench: speed of the update
seeing          5 minutes   vision_bench: speed and accuracy of the patch tracker
latency        10 minutes   perimap bench
END
}

build=build/release
keep=
records=
names=()
while [ $# -gt 0 ]; do
  case $1 in
    --build)
      build=${2:?--build needs a folder}
      build=${build%/}
      shift
      ;;
    --keep)
      keep=${2:?--keep needs a folder}
      shift
      ;;
    --records)
      records=${2:?--records needs a folder}
      shift
      ;;
    --list)
      list
      exit 0
      ;;
    -h | --help)
      usage
      exit 0
      ;;
    -*)
      echo "make.sh: unknown option $1" >&2
      usage >&2
      exit 2
      ;;
    *)
      if ! list | grep -q "^$1 "; then
        echo "make.sh: there is no table $1; --list names them" >&2
        exit 2
      fi
      names+=("$1")
      ;;
  esac
  shift
done
if [ ${#names[@]} -eq 0 ]; then
  mapfile -t names < <(list | { if [ -n "$records" ]; then cat; else grep -v 'of --records$'; fi; } | cut -d ' ' -f 1)
fi

if [ -n "$keep" ]; then
  mkdir -p "$keep"
  work=$keep
else
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
fi

perimap=$build/daemon/perimap
statistics=$build/tests/statistics/statistics
benches=$build/tests/bench

machine() {
  local model system
  model=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)
  system=$(uname -s -r | cut -d - -f 1)
  printf '%s, %s processors, %s, load %s' "${model:-unknown processor}" "$(nproc)" "$system" "$(cut -d ' ' -f 1 /proc/loadavg)"
}

# The newest commit that changed what is measured; documents do not count.
commit() {
  local changed=
  git diff --quiet HEAD -- core drivers daemon idl tests cmake || changed=', with changes'
  printf '%s%s' "$(git log -1 --format='%h of %cs' -- core drivers daemon idl tests cmake)" "$changed"
}

# Lines that are a table stay; any other text is set as it was printed.
as_printed() {
  local text
  text=$(cat)
  if grep -q '^|' <<< "$text"; then
    printf '%s\n' "$text"
  else
    printf '```\n%s\n```\n' "$text"
  fi
}

# is_there PROGRAM, or says what makes it.
is_there() {
  [ -x "$1" ] && return 0
  echo "make.sh: $1 is not there; to build it: cmake --preset ${build##*/} -DPERIMAP_TESTS=all &&" \
    "cmake --build --preset ${build##*/} --target ${1##*/}" >&2
  return 1
}

# run PROGRAM ARGUMENT...: what it says on standard error is told when it fails.
run() {
  is_there "$1" || return 1
  "$@" 2> "$work/errors" || { cat "$work/errors" >&2; return 1; }
}

# One function for each table, make_NAME; `command` is what the table's last line names.
for part in docs/evidence/tables/*.sh; do
  # shellcheck source=/dev/null
  . "$part" || exit 1
done

# put NAME FILE: the text of FILE into the place of NAME, or to standard output where it has none.
put() {
  local page
  page=$(grep -lF "<!-- made: $1 -->" docs/evidence/*.md)
  if [ -z "$page" ]; then
    cat "$2"
    return 0
  fi
  if [ "$(wc -w <<< "$page")" != 1 ]; then
    echo "make.sh: $1 has a place in these pages, expected one: $page" >&2
    return 1
  fi
  awk -v name="$1" -v text="$2" '
    $0 == "<!-- end: " name " -->" { inside = 0 }
    !inside { print }
    $0 == "<!-- made: " name " -->" { inside = 1; while ((getline line < text) > 0) print line }
  ' "$page" > "$work/page.md" && cat "$work/page.md" > "$page"
}

status=0
for name in "${names[@]}"; do
  echo "$name ..."
  command=
  # Not in a subshell: the function names its command.
  if "make_${name//-/_}" > "$work/$name.table" && [ -s "$work/$name.table" ]; then
    {
      echo
      cat "$work/$name.table"
      printf '\nMade by `docs/evidence/make.sh %s` (`%s`) at commit %s: %s, preset %s.\n\n' "$name" "$command" "$(commit)" \
        "$(machine)" "$(basename "$build")"
    } > "$work/$name.block"
    put "$name" "$work/$name.block" || status=1
  else
    echo "make.sh: $name gave no table" >&2
    status=1
  fi
done
exit $status
