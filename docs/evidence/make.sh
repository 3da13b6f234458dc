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
  A table that has no place in a page (setups, latency: their pages put several runs beside each other) is printed.
  --build  where the programs are: build/release (the default) or another preset's folder
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
watched-setups  2 minutes   statistics_watched_setups: what the watch says of right and wrong set-ups
watched-lies   15 minutes   what the watch says in sessions whose set-up is wrong
watched-truth  20 minutes   what it says in sessions whose set-up is right
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

# ---- the figures of one replay, from its own words

# simulate STEM OPTION...: makes the recording $work/STEM.mcap unless it is there.
simulate() {
  local stem=$1
  shift
  [ -e "$work/$stem.mcap" ] && return 0
  "$perimap" simulate "$work/$stem.mcap" "$@" > "$work/$stem.log" 2>&1 || { cat "$work/$stem.log" >&2; return 1; }
}

# replay STEM NAME: in lockstep with the configuration read from standard input; its words go to $work/NAME.txt.
replay() {
  { echo 'version = 1'; cat; } > "$work/$2.toml"
  "$perimap" replay "$work/$1.mcap" -c "$work/$2.toml" --lockstep > "$work/$2.txt" 2> "$work/$2.log" ||
    { cat "$work/$2.log" >&2; return 1; }
}

# figure NAME WHICH: of $work/NAME.txt.
figure() {
  local pattern
  case $2 in
    rms) pattern='s/^error .*RMS \([0-9.]*\) mm.*/\1/p' ;;
    median) pattern='s/^error .*median \([0-9.]*\) mm.*/\1/p' ;;
    p95) pattern='s/^error .*95th percentile \([0-9.]*\) mm.*/\1/p' ;;
    largest) pattern='s/^error .*largest \([0-9.]*\) mm.*/\1/p' ;;
    nees) pattern='s/^consistency mean NEES\/3 \([0-9.]*\).*/\1/p' ;;
    converged) pattern='s/^features .* \([0-9]*\) converged.*/\1/p' ;;
    early) pattern='s/^features .* \([0-9]*\) of them within 15 s.*/\1/p' ;;
    off) pattern='s/^good  *\([0-9]* of [0-9]*\) positions.*/\1/p' ;;
  esac
  local value
  value=$(sed -n "$pattern" "$work/$1.txt" | head -n 1)
  printf '%s' "${value:-none}"
}

# ---- one function for each table; `command` is what its last line names

experiment() {
  command="perimap experiment $1"
  # Columns are two blanks apart or more.
  "$perimap" experiment "$1" 2> /dev/null | awk -F '  +' '
    /^path error/ { head = 1 }
    head && NF > 3 {
      line = "|"
      for (i = 1; i <= NF; ++i) line = line " " $i " |"
      print line
      if (head++ == 1) { line = "|"; for (i = 1; i <= NF; ++i) line = line "---|"; print line }
    }'
}
make_experiment_1() { experiment 1; }
make_experiment_2() { experiment 2; }

make_displayed() {
  command='perimap simulate --ecg RECORD --duration 60 --tracker-noise 0 --seed 5; perimap replay --lockstep with pipeline.lead_ms'
  echo '| record | 0 ms | 100 ms | 300 ms |'
  echo '|---|---|---|---|'
  local record lead row
  for record in 100 123; do
    simulate "displayed-$record" --ecg $record --duration 60 --tracker-noise 0 --seed 5 || return 1
    row="| $record |"
    for lead in 0 100 300; do
      replay "displayed-$record" "displayed-$record-$lead" <<< "$(printf '[pipeline]\nlead_ms = %s' $lead)" || return 1
      row="$row $(figure "displayed-$record-$lead" rms) |"
    done
    echo "$row"
  done
}

make_image() {
  command='perimap simulate --ecg RECORD --motion LAW --duration 40 --seed 5; perimap replay --lockstep with phase.law LAW, phase.from_image false and true'
  echo '| rhythm, motion | ECG alone: median / 95 % / NEES/3 | with the image |'
  echo '|---|---|---|'
  local record law noise name stem
  while read -r record law noise name; do
    stem=image-$record-$law-$noise
    simulate "$stem" --ecg "$record" --motion "$law" --duration 40 --tracker-noise "$noise" --seed 5 || return 1
    replay "$stem" "$stem-alone" <<< "$(printf '[phase]\nlaw = "%s"\nfrom_image = false' "$law")" || return 1
    replay "$stem" "$stem-image" <<< "$(printf '[phase]\nlaw = "%s"\nfrom_image = true' "$law")" || return 1
    local columns=() with
    for with in alone image; do
      columns+=("$(figure "$stem-$with" median) / $(figure "$stem-$with" p95) mm / $(figure "$stem-$with" nees)")
    done
    echo "| $name | ${columns[0]} | ${columns[1]} |"
  done << 'END'
100 linear 0 100, linear
100 linear 1.4 100, linear, tracker 1.4 mm
100 warped 0 100, warped
100 time-locked 0 100, time-locked
106 linear 0 106, bigeminy
119 linear 0 119, bigeminy
105 linear 0 105, high-grade noise
END
}

make_breathing() {
  command='perimap simulate --respiration 10 --duration 60 --seed 5; perimap replay --lockstep with respiration.enabled'
  echo '| tracker | breathing | converged | error, median / 95 % / largest | NEES/3 |'
  echo '|---|---|---|---|---|'
  local noise breath enabled name stem
  while read -r noise breath enabled name; do
    stem=breathing-$noise-$breath
    simulate "$stem" --respiration "$breath" --duration 60 --tracker-noise "$noise" --seed 5 || return 1
    replay "$stem" "$stem-$enabled" <<< "$(printf '[respiration]\nenabled = %s' "$enabled")" || return 1
    echo "| $name | $(figure "$stem-$enabled" converged) | $(figure "$stem-$enabled" median) / $(figure "$stem-$enabled" p95) / $(figure "$stem-$enabled" largest) mm | $(figure "$stem-$enabled" nees) |"
  done << 'END'
0 10 true exact | on
0 10 false exact | off: suspected
1.4 10 true 1.4 mm | on
1.4 10 false 1.4 mm | off: suspected
0 0 false exact | none there, off
END
}

make_slow_tracker() {
  command='perimap simulate --duration 60 --seed 5 --tracker-noise 1.4 --tracker-correlation TAU; perimap replay --lockstep with tracker.error_correlation_s TAU and 0'
  echo '| correlation time | told | converged within 15 s, in all | error, median / 95 % | NEES/3 | called good, off by more than 3 mm |'
  echo '|---|---|---|---|---|---|'
  local tau told stem
  for tau in 0.5 5; do
    simulate "slow-$tau" --duration 60 --seed 5 --tracker-noise 1.4 --tracker-correlation $tau || return 1
    for told in $tau 0; do
      stem=slow-$tau-$told
      replay "slow-$tau" "$stem" <<< "$(printf '[tracker]\nerror_correlation_s = %s' "$told")" || return 1
      echo "| $tau s | $([ "$told" = 0 ] && echo 'no, taken for white' || echo yes) | $(figure "$stem" early), $(figure "$stem" converged) | $(figure "$stem" median) / $(figure "$stem" p95) mm | $(figure "$stem" nees) | $(figure "$stem" off) |"
    done
  done
}

# lens NAME FOCAL CENTRE: the simulator's lens at 320x240 as NAME.yaml, its focal length times FOCAL and its principal
# point CENTRE px to the right.
lens() {
  cat > "$work/$1.yaml" << END
%YAML:1.0
---
image_width: 320
image_height: 240
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ $(awk "BEGIN { print 400 * $2 }"), 0., $(awk "BEGIN { print 163.34 + $3 }"), 0., $(awk "BEGIN { print 400.8 * $2 }"), 117.34, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.12, 0.05, 0.0006, -0.0004, 0 ]
END
}

make_precision() {
  command='perimap simulate --duration 40; perimap replay --lockstep with estimation.precision'
  echo '| tracker, precision | RMS | median | 95 % | largest, mm | NEES/3 |'
  echo '|---|---|---|---|---|---|'
  local noise precision stem
  for noise in 0 1.4; do
    simulate "precision-$noise" --duration 40 --tracker-noise $noise || return 1
    for precision in double single; do
      stem=precision-$noise-$precision
      replay "precision-$noise" "$stem" <<< "$(printf '[estimation]\nprecision = "%s"' $precision)" || return 1
      echo "| $noise mm, $precision | $(figure "$stem" rms) | $(figure "$stem" median) | $(figure "$stem" p95) | $(figure "$stem" largest) | $(figure "$stem" nees) |"
    done
  done
}

of_statistics() {
  command="statistics --long $1"
  "$statistics" --long "$1" 2> /dev/null | as_printed
}
make_lost() { of_statistics lost; }
make_optimal() { of_statistics optimal; }
make_breath() { of_statistics breath; }
make_harmonics() { of_statistics harmonics; }
make_drift() { of_statistics drift; }
make_pose() { of_statistics pose; }
make_ecg() { of_statistics ecg; }
# The seed was drawn after the detector was chosen.
of_statistics_ecg() {
  command="statistics_ecg $*"
  "$build/tests/statistics/statistics_ecg" "$@" 2> /dev/null | as_printed
}
of_records() {
  [ -n "$records" ] || { echo "make.sh: --records names the folder of the records" >&2; return 1; }
  command="statistics_ecg $* --records FOLDER"
  "$build/tests/statistics/statistics_ecg" "$@" --records "$records" | as_printed
}
make_ecg_made() { of_statistics_ecg made --draws 3000 --seed 2050050581; }
make_ecg_paced() { of_statistics_ecg paced --draws 200 --seed 2050050581; }
make_ecg_records() { of_records records peak-times ventricular prediction starts; }
make_ecg_disturbed() { of_records disturbed --seed 2050050581; }
make_ecg_two_leads() { of_records two-leads --seed 2050050581; }
make_horizons() { of_statistics horizons; }
make_late() { of_statistics late; }
make_ventilated() { of_statistics ventilated; }

make_setups() {
  command='statistics_setups --seed 996341 --trials 50 hand-eye slow tool tracker scope camera'
  # shellcheck disable=SC2086
  "$build/tests/statistics/"$command | as_printed
}

make_watched_setups() {
  command='statistics_watched_setups 60'
  "$build/tests/statistics/statistics_watched_setups" 60 | as_printed
}

# told NAME KEY: of "setup" in $work/NAME.json, or of the accuracy; the key's first place is the right one.
told() {
  sed -n "s/^ *\"$2\": \"*\([^\",]*\)\"*,*\$/\1/p" "$work/$1.json" | head -n 1
}
# doubted_after NAME: in words.
doubted_after() {
  local after
  after=$(told "$1" doubted_after_s)
  if [ "$after" = null ]; then echo never; else printf '%.1f s' "$after"; fi
}
# replay_told STEM NAME: as replay, with $work/NAME.json.
replay_told() {
  { echo 'version = 1'; cat; } > "$work/$2.toml"
  "$perimap" replay "$work/$1.mcap" -c "$work/$2.toml" --lockstep --json "$work/$2.json" > "$work/$2.txt" 2> "$work/$2.log" ||
    { cat "$work/$2.log" >&2; return 1; }
}

make_watched_lies() {
  command='perimap simulate --duration 36 --size 320x240 --seed 1 --tracker-noise 0 and 1.4; perimap replay --lockstep --json with another calibration, tracker.hand_eye_..., tracker.time_offset_ms'
  echo '| wrong by | tracker | doubted after | blamed | good, and off by more than 3 mm | their NEES/3 | widened by |'
  echo '|---|---|---|---|---|---|---|'
  local noise stem focal centre settings name
  for noise in 0 1.4; do
    simulate "watched-$noise" --duration 36 --size 320x240 --seed 1 --tracker-noise $noise || return 1
    while IFS='|' read -r stem focal centre settings name; do
      stem=watched-$noise-$stem
      lens "$stem" "$focal" "$centre"
      replay_told "watched-$noise" "$stem" <<< "$(printf '[camera]\ncalibration = "%s.yaml"\n[tracker]\n%s' "$stem" "$settings")" || return 1
      echo "| $name | $noise mm | $(doubted_after "$stem") | $(told "$stem" number | sed 's/null/none/') | $(told "$stem" good_positions_off) of $(told "$stem" good_positions) | $(printf %.2f "$(told "$stem" good_positions_mean_nees)") | $(printf %.2f "$(told "$stem" widened_mm)") mm |"
    done << 'END'
none|1|0||nothing
turn-1|1|0|hand_eye_rotation_SC_wxyz = [0.821893931, 0.065559176, -0.039817494, 0.564452769]|hand-eye turned by 1 degree
turn-3|1|0|hand_eye_rotation_SC_wxyz = [0.819388640, 0.091963004, -0.032212050, 0.564895960]|hand-eye turned by 3 degrees
across-5|1|0|hand_eye_translation_SC_mm = [5.998549, -2.200930, 15.283437]|hand-eye 5 mm across
along-5|1|0|hand_eye_translation_SC_mm = [4.211406, -7.643971, 19.428243]|hand-eye 5 mm along
focal-3|1.03|0||focal length 3 %
focal-5|1.05|0||focal length 5 %
centre-10|1|10||principal point 10 px
centre-20|1|20||principal point 20 px
late-10|1|0|time_offset_ms = 10.0|time offset 10 ms
late-30|1|0|time_offset_ms = 30.0|time offset 30 ms
END
  done
}

# Seeds, rhythms, laws, breathing, noise and what hides the view were drawn.
make_watched_truth() {
  command='perimap simulate --duration 60 --size 320x240 with what stands in the row; perimap replay --lockstep --json'
  echo '| session | doubted after | at the end | widened by | good | off by more than 3 mm | their NEES/3 |'
  echo '|---|---|---|---|---|---|---|'
  local number=0 options stem
  while read -r options; do
    number=$((number + 1))
    stem=watched-truth-$number
    # shellcheck disable=SC2086
    simulate "$stem" --duration 60 --size 320x240 $options || return 1
    replay_told "$stem" "$stem" <<< '' || return 1
    echo "| \`$options\` | $(doubted_after "$stem") | $(told "$stem" state) | $(printf %.2f "$(told "$stem" widened_mm)") mm | $(told "$stem" good_positions) | $(told "$stem" good_positions_off) | $(told "$stem" good_positions_mean_nees | sed 's/^\(.*\.[0-9][0-9]\).*/\1/') |"
  done << 'END'
--seed 63117 --ecg 105 --motion time-locked --tracker-noise 2.0
--seed 28022 --ecg 106 --motion linear --tracker-noise 0 --glints 6
--seed 52533 --ecg 123 --motion time-locked --tracker-noise 0 --instrument
--seed 22892 --ecg 106 --motion warped --tracker-noise 0 --respiration 4.4 --respiration-period 5.3 --instrument
--seed 16944 --ecg 123 --motion time-locked --tracker-noise 1.4
--seed 3242 --ecg 105 --motion linear --tracker-noise 0 --respiration 9.5 --respiration-period 5.4
--seed 49914 --ecg 119 --motion linear --tracker-noise 1.4 --respiration 3.2 --respiration-period 5.2
--seed 81891 --ecg 123 --motion linear --tracker-noise 0.7
--seed 26553 --ecg 105 --motion linear --tracker-noise 1.4 --smoke 1
--seed 5270 --ecg 100 --motion linear --tracker-noise 2.0 --glints 6
--seed 79008 --ecg 100 --motion warped --tracker-noise 1.4
--seed 90034 --ecg 105 --motion linear --tracker-noise 0 --respiration 5.8 --respiration-period 4.3 --instrument
--seed 36815 --ecg 105 --motion linear --tracker-noise 1.4 --respiration 9.2 --respiration-period 3.4 --glints 6
--seed 7260 --ecg 105 --motion warped --tracker-noise 1.4 --instrument
END
}

# of_procedure NAME WHAT: from the words of $work/NAME.txt.
of_procedure() {
  local pattern
  case $2 in
    available) pattern='s/^procedure  *availability \([0-9.]*\) % of .*/\1/p' ;;
    seen) pattern='s/^procedure  *availability .* of \([0-9]*\) s in which.*/\1/p' ;;
    alarms) pattern='s/^ *\([0-9]*\) false alarms in .*/\1/p' ;;
    scored) pattern='s/^ *[0-9]* false alarms in \([0-9]*\) s .*/\1/p' ;;
    wrong) pattern='s/.* wrong while good \([0-9.]*\) s (.*/\1/p' ;;
    unknowable) pattern='s/.* wrong while good [0-9.]* s (\([0-9.]*\) s of them.*/\1/p' ;;
    causes) pattern='s/^ *causes \(.*\) right;.*/\1/p' ;;
    again) pattern='s/^ *causes .*; \(.*\) events good again.*/\1/p' ;;
    worst) pattern='s/^ *worst ten seconds from \([0-9]*\) s on: \([0-9.]*\) s wrong while good, largest error \([0-9.]*\) mm/\2 s, \3 mm (from \1 s)/p' ;;
  esac
  sed -n "$pattern" "$work/$1.txt" | head -n 1
}

# Seeds were drawn.
make_procedures() {
  command='perimap simulate --duration 300 --size 320x240 --fps 15 --tracker-dropouts 0 --procedure config/procedures/NAME.toml --seed SEED, and --procedure draw:SEED --electromagnetic --seed SEED; perimap replay --lockstep --json'
  echo '| procedure, seed | availability | false alarms | wrong while good | causes right | good again in time | worst ten seconds: wrong, largest error |'
  echo '|---|---|---|---|---|---|---|'
  local name seed stem script
  while read -r name seed; do
    stem=procedure-$name-$seed
    script=config/procedures/$name.toml
    if [ "$name" = drawn ]; then script="draw:$seed --electromagnetic"; fi
    if [ ! -e "$work/$stem.txt" ]; then
      # shellcheck disable=SC2086
      simulate "$stem" --duration 300 --size 320x240 --fps 15 --tracker-dropouts 0 --procedure $script --seed "$seed" || return 1
      replay_told "$stem" "$stem" <<< '' || return 1
      rm "$work/$stem.mcap"  # 350 MB
    fi
    echo "| $name, $seed | $(of_procedure "$stem" available) % of $(of_procedure "$stem" seen) s | $(of_procedure "$stem" alarms) | $(of_procedure "$stem" wrong) s | $(of_procedure "$stem" causes) | $(of_procedure "$stem" again) | $(of_procedure "$stem" worst) |"
    echo "$(of_procedure "$stem" available) $(of_procedure "$stem" seen) $(of_procedure "$stem" alarms) $(of_procedure "$stem" scored) $(of_procedure "$stem" wrong) $(of_procedure "$stem" causes) $(of_procedure "$stem" again)" |
      sed 's/none to judge/0 of 0/' >> "$work/procedures.sum"
  done << 'END'
valve 11982460
retracted 13194855
in_and_out 14100358
rhythm 13767589
tracker 1884746
drawn 13182629
drawn 13154176
drawn 8656301
drawn 8266783
drawn 2795289
END
  awk '{ share += $1 * $2; seen += $2; alarms += $3; scored += $4; wrong += $5; right += $6; judged += $8; again += $9; had += $11 }
    END { printf "| all | %.1f %% of %d s | %.1f an hour | %.0f s an hour | %d of %d | %d of %d | |\n", share / seen, seen,
      3600 * alarms / scored, 3600 * wrong / scored, right, judged, again, had }' "$work/procedures.sum"
  rm "$work/procedures.sum"
}

make_update() {
  command='update_bench'
  "$benches/update_bench" 2> /dev/null | as_printed
}
make_seeing() {
  command='vision_bench'
  "$benches/vision_bench" 2> /dev/null | as_printed
}
make_latency() {
  command='perimap simulate --size 640x480 --fps 60 --duration 25 --tracker-noise 0; perimap bench'
  simulate latency --size 640x480 --fps 60 --duration 25 --tracker-noise 0 || return 1
  "$perimap" bench "$work/latency.mcap" 2> /dev/null | as_printed
}

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
