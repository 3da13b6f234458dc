#!/bin/bash
# perimap calibrate --live, and perimap verify --live: a set-up that is drawn by a seed is measured from devices while they
# run, by emulators and a camera that is played back in step. What is missing is told meanwhile, a signal ends it cleanly,
# and what can not be measured is refused with nothing changed and nothing left behind.
# live_devices_are_guided.sh PERIMAP WORK_FOLDER SEED
set -uo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/../emulated_devices.sh"
. "$(dirname "$0")/../figures.sh"
cd "$work" || exit 1
mkdir temporary

# play: tracker and pointer anew, from the recording's beginning; the camera's playback begins with them
play() {
  if [ -n "${emulators:-}" ]; then
    kill "$emulators"
    wait "$emulators"
    ended "$emulators"
  fi
  emulate board.mcap --ndi-tools 1 --tool 0C=pivot:4,-6,120
  if [ -e devices.toml ]; then
    sed -i "s/^playback_start_s = .*/playback_start_s = $start/" devices.toml
  else
    devices_toml "$work/board.mcap" | sed 's/^\[tracker\]/[tracker]\nsensor = "0A"\npointer = "0C"/' > devices.toml
  fi
}
live() { TMPDIR=$work/temporary "$perimap" "$@" 2> told; }
# told_lines N: that so many lines, one every five seconds, told how it goes
told_lines() { [ "$(grep -cE '^perimap [a-z -]+: [0-9]+ s: ' told)" -ge "$1" ] || fail "how it goes was hardly told: $(cat told)"; }
nothing_left() { [ -z "$(ls temporary)" ] || fail "$1 left something behind: $(ls temporary)"; }

"$perimap" simulate board.mcap --scene board --setup-seed "$seed" --seed "$seed" --size 640x480 --duration 45 --fps 15 \
  --truth truth.json > out 2>&1 || fail "no recording: $(cat out)"

# ---- recorded while nobody knows the lens
play
"$perimap" record -c devices.toml unmeasured.mcap --seconds 12 > out 2>&1 || fail "record without a lens: $(cat out)"
"$perimap" calibrate tool --from unmeasured.mcap --json > out 2> told || grep -q 'turned about' told ||
  fail "the recording has no pointer: $(cat told)"

# ---- the lens: which part of the picture has not seen the board
play
live calibrate camera --live devices.toml --square-mm 8 --output camera.yaml --configuration devices.toml \
  --html camera.html --json --seconds 52 > camera.json || fail "calibrate camera --live: $(cat told)"
grep -q 'no board is seen: bring all of it into view' told || fail "it was not told that no board is seen: $(cat told)"
grep -qE '[0-9]+ views' told || fail "the views were not told: $(cat told)"
grep -qE 'show it .*(left|right|middle)' told || fail "it was not told where the board is missing: $(cat told)"
told_lines 3
nothing_left "calibrate camera"
[ -s camera.html ] || fail "no page"
grep -q '^calibration = "camera.yaml"' devices.toml || fail "the configuration does not name the lens"
for i in 1 2; do
  near "focal length $i, px" "$(nth camera.json focal_px $i)" "$(nth truth.json focal_px $i)" 2.2
  near "principal point $i, px" "$(nth camera.json principal_point_px $i)" "$(nth truth.json principal_point_px $i)" 2
done

# ---- hand-eye: which turn is missing, and what is left over by now
play
live calibrate hand-eye --live devices.toml --square-mm 8 --configuration devices.toml --keep kept.mcap --json --seconds 52 \
  > hand-eye.json || fail "calibrate hand-eye --live: $(cat told)"
grep -qE 'AX - XB [0-9.]+ mm, held aside [0-9.]+ mm' told || fail "what is left over was not told: $(cat told)"
told_lines 4
if grep 'AX - XB' told | grep -q 'refused'; then fail "a tracker that delivers is said to be gone: $(cat told)"; fi
[ -s kept.mcap ] || fail "--keep kept nothing"
grep -q '^hand_eye_sensor = "0A"' devices.toml || fail "the hand-eye does not say of which sensor it is"
tr -d ' \n' < hand-eye.json | sed 's/"opencv":.*}},//' > ours.json
for i in 1 2 3; do
  near "hand-eye translation $i, mm" "$(nth ours.json translation_mm $i)" "$(nth truth.json translation_mm $i)" 0.7
done
# The emulated tracker's frames arrive some milliseconds after their time, as a real one's do.
near "time offset, ms" "$(number ours.json time_offset_ms)" "$(number truth.json time_offset_ms)" 12
# The simulated hand is about as brisk as is asked for (0.2 rad/s): on the slow side the command tells it, and leaves the
# offset to the user.
if ! grep -q '^time_offset_ms' devices.toml; then
  grep -q '"brisk": false' hand-eye.json || fail "a brisk motion set no offset"
  sed -i "s/^\[tracker\]/[tracker]\ntime_offset_ms = $(number ours.json time_offset_ms)/" devices.toml
fi
# The recording that was kept says the same.
"$perimap" calibrate hand-eye --from kept.mcap --square-mm 8 --calibration camera.yaml --json > kept.json 2> told ||
  fail "the kept recording: $(cat told)"
[ "$(nth hand-eye.json translation_mm 1)" = "$(nth kept.json translation_mm 1)" ] || fail "the kept recording says otherwise"
grep -q '"sensor": "0A"' kept.json || fail "the recording does not say of which sensor it is"

# ---- the pointer, which goes on when the camera's playback has ended
live calibrate tool --live devices.toml --output pointer.json > out || fail "calibrate tool --live: $(cat told)"
grep -qE 'turned [0-9]+ [0-9]+ [0-9]+ degrees about three axes; .*tip within' told || fail "the tip so far was not told: $(cat told)"
grep -q '"tool": "0C"' pointer.json || fail "the tip does not say of which tool it is"
near "pointer's tip, mm" "$(nth pointer.json tip_mm 3)" 120 0.5

# ---- the tracker's noise, with less time than it wants
play
live calibrate tracker --live devices.toml --tool pointer --seconds 6 > out
[ $? -eq 1 ] || fail "a pointer that is swung has a noise: $(cat out told)"
grep -q 'ended before there was enough of everything: still for 0 of 60 s' told || fail "that it ended early was not told: $(cat told)"
grep -q 'calibrate tracker: .*still' told || fail "it was not told why: $(cat told)"

# ---- is it right?
play
live verify devices.toml --live --square-mm 8 --bound-mm 3 --output verified.json > out || fail "verify --live: $(cat out told)"
grep -q '"passed": true' verified.json || fail "verify passed, and its record says otherwise"
grep -q 'rest the tip of a calibrated pointer' out || fail "what is not seen without a touched point was not told: $(cat out)"

# ---- the patient's image: which landmark is next; what was registered before is left aside
kill "$emulators"
wait "$emulators"
ended "$emulators"
"$perimap" simulate landmarks.mcap --scene landmarks --setup-seed "$seed" --seed "$seed" --landmarks image.csv > out 2>&1 ||
  fail "no recording: $(cat out)"
printf '{"tip_mm": [%s, %s, %s], "covariance": [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]}' \
  "$(nth truth.json tip_mm 1)" "$(nth truth.json tip_mm 2)" "$(nth truth.json tip_mm 3)" > tip.json
printf 'version = 1\n[tracker]\nprotocol = "ndi"\nport = "tcp:127.0.0.1:%s"\nsensor = "0A"\npointer = "0C"\nframe_rate_hz = 100\n' \
  $port > touched.toml
printf 'registration_translation_IW_mm = [1000.0, 0.0, 0.0]\n' >> touched.toml
emulate landmarks.mcap --ndi-tools 1
live register --live touched.toml --model image.csv --tip tip.json --configuration touched.toml --json --seconds 60 \
  > registration.json || fail "register --live: $(cat told)"
grep -q 'landmarks touched; touch landmark' told || fail "it was not told which landmark is next: $(cat told)"
if grep -q 'ended before' told; then fail "it did not end by itself: $(cat told)"; fi
nothing_left "register"
at_most "registration, mm left over" "$(number registration.json fre_mm)" 0.6
grep -q '^registration_translation_IW_mm = \[1000' touched.toml && fail "the registration was not written"
# Another image: the words are of the configuration, and not of what was recorded meanwhile.
awk -F, 'NR == 1 { print } NR > 1 { print $1 "," $2 * 1.5 "," $3 "," $4 }' image.csv > other.csv
emulate_anew() { kill "$emulators"; wait "$emulators"; ended "$emulators"; emulate landmarks.mcap --ndi-tools 1; }
emulate_anew
live register --live touched.toml --model other.csv --tip tip.json --seconds 20 > out
[ $? -eq 1 ] || fail "another image is registered: $(cat out told)"
if grep -q 'perimap-calibrate-' told; then fail "a file is named that nobody knows: $(cat told)"; fi
nothing_left "a registration that failed"

# ---- a signal ends it; what came until then does not do, and nothing is changed
play
cp devices.toml before.toml
: > told
live calibrate hand-eye --live devices.toml --square-mm 8 --configuration devices.toml --output stopped.json > out &
measuring=$!
started+=($measuring)
# The tracker is there by the second line, and the playback has not begun.
for _ in $(seq 150); do
  [ "$(grep -c ' s: ' told)" -ge 2 ] && break
  sleep 0.1
done
kill -INT $(pgrep -P $measuring)
wait $measuring
[ $? -eq 1 ] || fail "stopped before the board was seen, it ended otherwise: $(cat out told)"
ended $measuring
grep -q 'ended before there was enough of everything: no board is seen' told || fail "that it was stopped was not told: $(cat told)"
grep -qE 'has no camera frames|keep it in view while the scope is swung' told || fail "what is missing was not told: $(cat told)"
cmp -s devices.toml before.toml || fail "the configuration was changed: $(diff devices.toml before.toml)"
[ ! -e stopped.json ] || fail "a result was written"
nothing_left "a signal"

# ---- refused before anything is recorded, and when nothing came
live calibrate tool --live devices.toml --tool instrument/drill --keep none.mcap > out
[ $? -eq 2 ] && grep -q "names no tool 'instrument/drill' beside the sensor" told || fail "another tool: $(cat out told)"
live calibrate hand-eye --live devices.toml --keep none.mcap > out
[ $? -eq 2 ] && grep -q -e '--square-mm: expected' told || fail "a board of no size: $(cat out told)"
[ ! -e none.mcap ] || fail "a recording was begun"
kill "$emulators"
wait "$emulators"
ended "$emulators"
printf 'version = 1\n[tracker]\nprotocol = "ndi"\nport = "tcp:127.0.0.1:%s"\n' $port > gone.toml
live calibrate tracker --live gone.toml --configuration devices.toml --seconds 5 > out
[ $? -eq 1 ] && grep -q 'no device gave anything: perimap probe gone.toml says why' told || fail "no tracker: $(cat out told)"
cmp -s devices.toml before.toml || fail "the configuration was changed"
nothing_left "a tracker that is not there"
echo "as promised"
