#!/bin/bash
# The first hour of the guide, word for word: the commands of its numbered sections, taken out of the page in their order,
# are run on emulated devices whose set-up is drawn by a seed, from nothing to a session. What perimapd then publishes,
# in the frame of the patient's image, must be as near to the truth, within 1.3 times, as what it publishes by the true
# set-up. None of the programs is told the truth: boards have no set-up in their recordings, and the heart that is played
# has it taken out.
#
# What stands in for the hands and the devices, and nothing else is done to the commands:
# - the answers that perimap setup asks for at a terminal: no camera, the emulators' tracker and ECG;
# - in the configuration, below it, what the guide says to name there (sensor and pointer), and in place of the camera's
#   name a recording that is played, with the moment when it begins (perimap calibrate and perimapd take it so);
# - what lies on the bench while a command runs (`scene_of`);
# - a port of its own for perimap view, and ports of its own for DDS;
# - programs that go on until they are stopped are stopped.
# the_first_hour_word_for_word.sh PERIMAP PERIMAPD WORK_FOLDER SEED CYCLONEDDS_XML GUIDE
set -uo pipefail
work=$3 seed=$4 guide=$6
. "$(dirname "$0")/../emulated_devices.sh"
. "$(dirname "$0")/../figures.sh"
trap 'kill -9 "${started[@]}" 2> /dev/null; rm -rf "$short" "$work"/*.mcap' EXIT
mkdir "$short/bin"
ln -s "$1" "$short/bin/perimap"
ln -s "$2" "$short/bin/perimapd"
PATH=$short/bin:$PATH
perimap=perimap
sed "s|<Discovery>|<Discovery><Ports><Base>$((10000 + 250 * ($$ % 100)))</Base></Ports>|" "$5" > "$short/dds.xml"
export CYCLONEDDS_URI=file://$short/dds.xml
cd "$work" || exit 1

quiet() { perimap "$@" > out 2> told || fail "perimap $*: $(cat out told)"; }
settled() { tr -d ' \n' < "$1" | grep -o '"settled_error":{[^}]*' | grep -o "\"$2\":[0-9.e-]*" | cut -d: -f2; }

# ---- what is there
common=(--setup-seed "$seed" --size 640x480 --tracker-rate 60)
quiet simulate board.scene.mcap --scene board "${common[@]}" --seed "$seed" --duration 100 --fps 15 --truth truth.json \
  --landmarks image.csv
# What --moved tells is worked out while it lies there, before the minute that is asked for.
quiet simulate still.scene.mcap --scene still "${common[@]}" --seed "$seed" --fps 5 --duration 180
quiet simulate landmarks.scene.mcap --scene landmarks "${common[@]}" --seed "$seed"
quiet simulate heart.mcap "${common[@]}" --seed "$seed" --duration 36 --fps 15 --untold heart.scene.mcap
tr -d ' \n' < truth.json | sed 's/.*"registration"://; s/}.*/}/' > registration.truth.json
for told_key in hand_eye_translation_SC_mm position_deviation_mm; do
  grep -aq "^$told_key" heart.mcap || fail "the recording with the truth has none, so that this asks nothing"
  if grep -aq "^$told_key" ./*.scene.mcap; then fail "what is played tells $told_key"; fi
done

# ---- the guide's commands: of the numbered sections, without what stands below a heading of its own
commands=$(awk '
  /^## / { on = /^## [0-9]+\. /; next }
  /^### / { on = 0 }
  /^```/ { code = !code && /^```sh$/; next }
  on && code { sub(/ +# .*/, ""); if (sub(/\\$/, "")) { line = line $0; next } print line $0; line = "" }' "$guide")
for needed in 'setup' 'probe' 'calibrate target' 'calibrate camera --live' 'calibrate hand-eye --live' 'calibrate time' \
  'calibrate tool --live' 'calibrate tracker --live' 'register --live' 'check' 'verify' 'record' 'ecg' 'watch' 'view'; do
  grep -q "^perimap $needed" <<< "$commands" || fail "the guide has no 'perimap $needed': $commands"
done

# scene_of COMMAND: what lies on the bench, or is played, while it runs; empty: nothing that is played anew for it
scene_of() {
  case $1 in
    'perimap setup '* | 'perimap calibrate tracker --live '*) echo still ;;
    'perimap probe '* | 'perimap calibrate camera --live '* | 'perimap calibrate hand-eye --live '* | \
      'perimap calibrate tool --live '* | 'perimap verify '*) echo board ;;
    'perimap register '*) echo landmarks ;;
    'perimap record '* | 'perimapd '*) echo heart ;;
  esac
}
play() { # SCENE
  if [ -n "${emulators:-}" ]; then
    kill "$emulators"
    wait "$emulators"
    ended "$emulators"
  fi
  emulate "$work/$1.scene.mcap" --ndi-tools 1
  [ -e devices.toml ] || return 0
  # Scope and pointer that lie still are not looked at.
  local seen=$1
  [ "$seen" = still ] || [ "$seen" = landmarks ] && seen=board
  sed -i "s|^playback = .*|playback = \"$work/$seen.scene.mcap\"|; s/^playback_start_s = .*/playback_start_s = $start/" \
    devices.toml
}
ask_setup() { # COMMAND
  printf '0\nndi=tcp:127.0.0.1:%s\ncyton=%s\n' $port "$line" | script -qec "$1" /dev/null > out 2> told ||
    fail "$1: $(cat out told)"
  grep -q 'Which is the tracker' out || fail "perimap setup did not ask: $(cat out)"
  sed -i "s|^\[camera\]|[camera]\nplayback = \"$work/board.scene.mcap\"\nplayback_start_s = $start|
    s|^# sensor = .*|sensor = \"0A\"|; s|^# pointer = .*|pointer = \"0C\"|" devices.toml
}
# The daemon and who listens to it, as in terminals beside each other, until what is played has ended.
session() { # PERIMAPD
  local watching viewing
  eval "$(grep '^perimap watch' <<< "$commands") --wait 60" > watched 2>&1 &
  watching=$!
  eval "$(grep '^perimap view' <<< "$commands") --port 0" > viewed 2>&1 &
  viewing=$!
  started+=($watching $viewing)
  eval "$1" > log 2>&1 || fail "perimapd ended with $?: $(tail -n 5 log)"
  sleep 0.5
  kill -INT "$(pgrep -P $watching || echo $watching)" "$(pgrep -P $viewing || echo $viewing)"
  wait $watching || fail "watch ended with $?: $(tail -n 5 watched)"
  wait $viewing
  ended $watching
  ended $viewing
  grep -q 'http://127.0.0.1' viewed || fail "perimap view told no address: $(cat viewed)"
}

count=0
while read -r -u 3 command; do
  case $command in 'perimap watch'* | 'perimap view'*) continue ;; esac # beside perimapd
  begin_s=$(cut -d. -f1 /proc/uptime)
  scene=$(scene_of "$command")
  [ -z "$scene" ] || play "$scene"
  case $command in
    'perimap setup '*) ask_setup "$command" ;;
    'perimapd '*) session "$command" ;;
    *) eval "$command" > out 2> told || fail "$command: $(cat out told)" ;;
  esac
  count=$((count + 1))
  # On a busy machine the guide sees few of the frames, and asks for longer than the playback lasts.
  grep 'ended before' told || true
  echo "$(($(cut -d. -f1 /proc/uptime) - begin_s)) s: $command"
done 3<<< "$commands"
echo "$count commands of the guide"

# ---- what they measured, by the goals of set-ups measured for as long as the guide asks for
value() { sed -n "s/^$1 = \[*//p" devices.toml | tr -d ']' | sed 's/ *#.*//' | cut -d, -f"${2:-1}"; }
for i in 1 2 3; do
  near "hand-eye translation $i, mm" "$(value hand_eye_translation_SC_mm $i)" "$(nth truth.json translation_mm $i)" 0.7
  near "pointer's tip $i, mm" "$(nth pointer.json tip_mm $i)" "$(nth truth.json tip_mm $i)" 0.5
done
near "tracker's position noise, mm" "$(value position_deviation_mm)" "$(number truth.json position_deviation_mm)" 0.21
near "tracker's rotation noise, degrees" "$(value rotation_deviation_deg)" "$(number truth.json rotation_deviation_deg)" 0.075
near "time offset, ms" "$(value time_offset_ms)" "$(number truth.json time_offset_ms)" 2
# Of two quaternions, whichever their signs.
turned_deg() {
  awk -v w="$1 $2" 'BEGIN { split(w, q, " "); for (i = 1; i <= 4; ++i) { dot += q[i] * q[i + 4] }
    dot = dot < 0 ? -dot : dot; sine = dot < 1 ? sqrt(1 - dot * dot) : 0; print 360 / 3.14159265358979 * atan2(sine, dot) }'
}
rotation() { for i in 1 2 3 4; do "$@" $i; done | tr '\n' ' '; }
at_most "hand-eye rotation, degrees" \
  "$(turned_deg "$(rotation value hand_eye_rotation_SC_wxyz)" "$(rotation nth truth.json rotation_wxyz)")" 0.3
focal_px() { tr -d '\n' < camera.yaml | sed 's/.*camera_matrix[^[]*\[//; s/\].*//' | cut -d, -f"$1"; }
for i in 1 2; do
  truth_px=$(nth truth.json focal_px $i)
  near "focal length $i, px" "$(focal_px $((4 * i - 3)))" "$truth_px" "$(awk -v f="$truth_px" 'BEGIN { print 0.003 * f }')"
done
grep -q '^registration_translation_IW_mm' devices.toml || fail "no registration"

# ---- what was verified goes with the session
grep -q '"passed": true' devices.verified.json || fail "verify passed, and its record says otherwise"
grep -aq '"board_error_mm"' session.mcap || fail "the recording has nothing of the verification"
grep -q 'set-up verified: passed on' log || fail "perimapd's log does not tell of the verification: $(cat log)"
quiet check devices.toml
grep -q '^# set-up verified: passed on' out || fail "check does not tell of the verification: $(tail -n 3 out)"
sed 's/^time_offset_ms = .*/time_offset_ms = 250.0/' devices.toml > changed.toml
cp devices.verified.json changed.verified.json
quiet check changed.toml
grep -q 'warning: set-up verified: .* changed since' told || fail "check lets another set-up pass for the verified one: $(cat told)"
quiet session session.mcap --samples received.mcap --html session.html
grep -q 'Verified before it: passed on' session.html || fail "the session's page does not tell of the verification"

# ---- as good as by the true set-up
report() { # JSON
  quiet report heart.mcap --samples received.mcap --json "$1" --registration \
    $(for i in 1 2 3; do nth registration.truth.json translation_mm $i; done) \
    $(for i in 1 2 3 4; do nth registration.truth.json rotation_wxyz $i; done)
}
report measured.json
list() { tr -d ' \n' < "$1" | grep -o "\"$2\":\[[^]]*\]" | head -1 | cut -d: -f2; }
true_key() { sed -i "s/^$1 = .*/$1 = $2/" true.toml; }
printf '%%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ %s, 0., %s, 0., %s, %s, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: %s\n' \
  "$(nth truth.json focal_px 1)" "$(nth truth.json principal_point_px 1)" "$(nth truth.json focal_px 2)" \
  "$(nth truth.json principal_point_px 2)" "$(list truth.json distortion_coefficients)" > true.yaml
rm received.mcap
play heart
cp devices.toml true.toml
true_key calibration '"true.yaml"'
true_key hand_eye_translation_SC_mm "$(list truth.json translation_mm)"
true_key hand_eye_rotation_SC_wxyz "$(list truth.json rotation_wxyz)"
true_key time_offset_ms "$(number truth.json time_offset_ms)"
true_key position_deviation_mm "$(number truth.json position_deviation_mm)"
true_key rotation_deviation_deg "$(number truth.json rotation_deviation_deg)"
true_key error_correlation_s 0.0
true_key registration_translation_IW_mm "$(list registration.truth.json translation_mm)"
true_key registration_rotation_IW_wxyz "$(list registration.truth.json rotation_wxyz)"
session 'perimapd -c true.toml'
report true.json
for what in true measured; do
  echo "positions by the $what set-up: $(settled $what.json median_mm) mm (median of $(settled $what.json count)), $(settled $what.json p95_mm) mm (95 %)"
  [ "$(settled $what.json count)" -gt 2000 ] || fail "hardly anything was mapped by the $what set-up: $(cat $what.json)"
done
at_most "positions published by the measured set-up, mm" "$(settled measured.json median_mm)" \
  "$(awk -v true="$(settled true.json median_mm)" 'BEGIN { print 1.3 * true }')"
echo "as promised"
