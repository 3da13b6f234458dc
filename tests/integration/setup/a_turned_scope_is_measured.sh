#!/bin/bash
# An angled scope, calibrated at three turns through pictures and verified at a fourth; a session in which it is turned is
# as good by the measured function of the turn, within 1.5 times, as by the true one. The turn is told by the field stop in
# the pictures, or by a second tracked sensor.
# a_turned_scope_is_measured.sh PERIMAP PERIMAPD WORK_FOLDER SEED field-stop|second-sensor
set -euo pipefail
perimap=$1 perimapd=$2 work=$3 seed=$4 told_by=$5
. "$(dirname "$0")/folder.sh"

settled() { tr -d ' \n' < "$1" | grep -o '"settled_error":{[^}]*' | grep -o "\"$2\":[0-9.e-]*" | cut -d: -f2; }
times() { awk -v a="$1" -v b="$2" 'BEGIN { print a * b }'; }

common=(--setup-seed "$seed" --size 640x480)
by=()
if [ "$told_by" = second-sensor ]; then
  common+=(--second-sensor)
  by=(--by-second-sensor)
fi

# ---- measured through pictures
quiet setup --output devices.toml --camera none --tracker none --ecg none --seconds 0
at=()
for turn in 0 75 150; do
  quiet simulate board$turn.mcap --scene board "${common[@]}" --seed "$((seed + turn))" --duration 40 --fps 15 --field-stop $turn
  quiet calibrate camera --from board$turn.mcap --square-mm 8 --output camera$turn.yaml
  quiet calibrate hand-eye --from board$turn.mcap --square-mm 8 --calibration camera$turn.yaml --output hand-eye$turn.json
  at+=(--at board$turn.mcap hand-eye$turn.json camera$turn.yaml)
done
# Lens, clocks and noise of one of them; hand-eye and principal point are the function's.
quiet calibrate camera --from board0.mcap --square-mm 8 --output camera.yaml --configuration devices.toml
quiet calibrate hand-eye --from board0.mcap --square-mm 8 --configuration devices.toml
sed -i 's/^# *position_deviation_mm = .*/position_deviation_mm = 1.4/; s/^# *rotation_deviation_deg = .*/rotation_deviation_deg = 0.5/' devices.toml
quiet calibrate scope "${at[@]}" "${by[@]}" --output scope.json --configuration devices.toml --json
grep -q '^turned_scope = "scope.json"' devices.toml || fail "the configuration does not name the scope: $(cat devices.toml)"
at_most "left over, degrees" "$(number scope.json left_over_deg)" 0.4
at_most "held aside, mm" "$(number scope.json aside_mm)" 3
at_most "deviation of the hand-eye, mm" "$(number scope.json translation_mm_deviation)" 1.5
quiet check devices.toml
quiet simulate heart.mcap "${common[@]}" --seed "$seed" --duration 40 --field-stop 40 --turn-to 95 --turn-at 20
quiet replay heart.mcap --lockstep --json true.json
quiet replay heart.mcap --lockstep -c devices.toml --json measured.json
at_most "positions by the measured function, mm" "$(settled measured.json median_mm)" \
  "$(times 1.5 "$(settled true.json median_mm)")"

# ---- at a turn that nobody calibrated
quiet simulate check.mcap --scene board "${common[@]}" --seed "$((seed + 1000))" --duration 12 --fps 15 --field-stop 110
quiet verify devices.toml --from check.mcap --square-mm 8 --bound-mm 2.5
sed '/^turned_scope/d' devices.toml > as_it_was.toml
if "$perimap" verify as_it_was.toml --from check.mcap --square-mm 8 --bound-mm 2.5 > out 2> errors; then
  fail "verify lets the hand-eye of another turn pass: $(cat out)"
fi

if [ "$told_by" = second-sensor ]; then
  # ---- without the sensor that tells the turn: refused
  quiet simulate alone.mcap --setup-seed "$seed" --size 640x480 --seed "$seed" --duration 5
  if "$perimap" replay alone.mcap --lockstep -c devices.toml > out 2> errors; then fail "a recording without it is replayed"; fi
  grep -q "devices.toml:[0-9:]* key 'camera.turned_scope': expected one that is read in the pictures" errors || fail "$(cat errors)"
  sed '/^\[tracker\]/,/^\[/ s/^protocol = "none"/protocol = "ndi"\nport = "tcp:127.0.0.1:9"/' devices.toml > unnamed.toml
  if "$perimap" check unnamed.toml > out 2> errors; then fail "check takes a tracker without it"; fi
  grep -q "unnamed.toml:[0-9:]* key 'tracker.second_sensor': expected" errors || fail "$(cat errors)"
  # Another sensor than the one that it was measured of.
  sed 's/^{/{ "second_sensor": "0C",/' scope.json > second.json
  sed 's/^turned_scope = .*/turned_scope = "second.json"/; s/^\[tracker\]/[tracker]\nsecond_sensor = "0D"/' devices.toml > second.toml
  if "$perimap" replay heart.mcap --lockstep -c second.toml > out 2> errors; then fail "another second sensor's turn is taken"; fi
  grep -q "second.toml:[0-9:]* key 'tracker.second_sensor': expected \"0C\"" errors || fail "$(cat errors)"
  if "$perimap" verify second.toml --from check.mcap --square-mm 8 > out 2> errors; then fail "verify takes another second sensor"; fi
  grep -q "second.toml:[0-9:]* key 'tracker.second_sensor': expected \"0C\"" errors || fail "$(cat errors)"
  # Two at the same turn.
  if "$perimap" calibrate scope --by-second-sensor --at board0.mcap hand-eye0.json camera0.yaml --at board0.mcap \
    hand-eye0.json camera0.yaml --at board0.mcap hand-eye0.json camera0.yaml > out 2> errors; then
    fail "three calibrations at one turn are taken: $(cat out)"
  fi
  grep -q "the second sensor turned by 0.*at most" errors || fail "$(cat errors)"
  exit 0
fi

# ---- of another camera, or of another sensor: refused, also by a configuration that names no devices
# refused FILE WORDS PROGRAM ARGUMENTS...: in one line, and with the exit code of a wrong configuration
refused() {
  local file=$1 words=$2 code=0
  shift 2
  "$@" > out 2> errors || code=$?
  [ "$code" -eq 2 ] || fail "$*: ended with $code: $(cat out errors)"
  [ "$(grep -c . errors)" -eq 1 ] || fail "$*: not one line: $(cat errors)"
  grep -q "$file:[0-9:]* key 'camera.turned_scope': expected $words" errors || fail "$*: does not say what is wrong: $(cat errors)"
}
sed 's/"picture_px": \[/"picture_px": [ 1280, 720 ], "was": [/' scope.json > other.json
sed 's/^turned_scope = .*/turned_scope = "other.json"/' devices.toml > other.toml
refused other.toml "one of pictures of 640x480" "$perimap" check other.toml
refused other.toml "one of pictures of 640x480" "$perimap" replay heart.mcap --lockstep -c other.toml
sed 's/^{/{ "sensor": "0A",/' scope.json > sensor.json
sed 's/^turned_scope = .*/turned_scope = "sensor.json"/; s/^\[tracker\]/[tracker]\nsensor = "0B"/' devices.toml > sensor.toml
refused sensor.toml 'one of "0B", the tracker.sensor' "$perimap" check sensor.toml
for name in other sensor; do
  printf '\n[replay]\nrecording = "heart.mcap"\n' | cat $name.toml - > replayed.toml
  refused replayed.toml "one of" "$perimap" check replayed.toml
  refused replayed.toml "one of" "$perimapd" -c replayed.toml
done
