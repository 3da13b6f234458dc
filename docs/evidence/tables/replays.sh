# Read by ../make.sh: experiments and replays with one thing changed. `command` is what a table's last line names.

experiment() {
  command="perimap experiment $1"
  # Columns are two blanks apart or more.
  run "$perimap" experiment "$1" | awk -F '  +' '
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
