# Read by ../make.sh: what the watch over the set-up says.

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
  is_there "$perimap" || return 1
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
