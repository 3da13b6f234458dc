#!/bin/bash
# An angled scope, measured at two turns and at two other zooms from emulated devices while they run: the user is told
# when to turn and when to zoom, and of sensors that the tracker has lost. Then a heart is mapped by what was measured,
# while the scope is turned and zoomed to where nobody measured it.
# a_scope_is_zoomed_live.sh PERIMAP WORK_FOLDER SEED
set -uo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/../emulated_devices.sh"
. "$(dirname "$0")/../figures.sh"
trap 'kill -9 "${started[@]}" 2> /dev/null; rm -rf "$short" "$work"/*.mcap' EXIT
cd "$work" || exit 1

quiet() { "$perimap" "$@" > out 2> told || fail "perimap $*: $(cat out told)"; }
settled() { tr -d ' \n' < "$1" | grep -o '"settled_error":{[^}]*' | grep -o "\"$2\":[0-9.e-]*" | cut -d: -f2; }
# focal FILE N I: of the Nth of the zooms
focal() { tr -d ' \n' < "$1" | grep -o '"zooms":\[.*' | grep -o '"focal_px":\[[^]]*' | sed -n "$2p" | cut -d'[' -f2 | cut -d, -f"$3"; }
times() { awk -v a="$1" -v b="$2" 'BEGIN { print a * b }'; }

common=(--setup-seed "$seed" --size 640x480 --field-stop 0)
quiet simulate turns.mcap --scene board "${common[@]}" --seed "$seed" --duration 152 --fps 15 --truth truth.json \
  --turn-to 75 --turn-at 36 --zoom-to 0.88 --zoom-at 74 --zoom-to 1.14 --zoom-at 112
# measured FILE: focal lengths at the two zooms, 0.3 %
measured() {
  local i zoom
  for i in 1 2; do
    for zoom in 0.88 1.14; do
      near "$1: focal length $i at a zoom of $zoom, px" "$(focal "$1" "$([ $zoom = 0.88 ] && echo 1 || echo 2)" $i)" \
        "$(times $zoom "$(nth truth.json focal_px $i)")" 2.2
    done
  done
}

# ---- one recording of all of it
quiet calibrate scope --from turns.mcap --square-mm 8 --output recorded.json
measured recorded.json
rows=$(tr -d ' \n' < recorded.json | grep -o '"focal_px_by_field_stop_radius_px":\[\[.*\]\],"left' | grep -o '\],\[' | wc -l)
[ "$rows" -eq 2 ] || fail "a table of other than three focal lengths: $(cat recorded.json)"

# ---- likewise from devices, guided; the tracker loses its tools for four seconds, again and again
emulate turns.mcap --ndi-tools 1 --missing 23 4
devices_toml "$work/turns.mcap" | sed 's/^\[tracker\]/[tracker]\nsensor = "0A"/' > devices.toml
"$perimap" calibrate scope --live devices.toml --square-mm 8 --turns 2 --zooms 2 --output scope.json \
  --configuration devices.toml --seconds 166 > out 2> told || fail "calibrate scope --live: $(cat out told)"
for words in 'turn 1 of 2: ' 'turn the scope in its camera head by 60 degrees' 'zoom or focus to an end' 'zoom 1 of 2: ' \
  'zoom 2 of 2: ' 'the sensor has not been seen for [0-9]* s: bring it into sight of the tracker'; do
  grep -q "$words" told || fail "it was not told: $words: $(cat told)"
done
if grep -q 'ended before' told; then fail "it did not end by itself: $(cat told)"; fi
measured scope.json
kill "$emulators"
wait "$emulators"
ended "$emulators"

# ---- a heart, at a turn and a zoom between those
quiet simulate board.mcap --scene board "${common[@]}" --seed "$((seed + 1))" --duration 30 --fps 15
quiet setup --output session.toml --camera none --tracker none --ecg none --seconds 0
quiet calibrate camera --from board.mcap --square-mm 8 --output camera.yaml --configuration session.toml
quiet calibrate hand-eye --from board.mcap --square-mm 8 --configuration session.toml
sed -i 's/^# *position_deviation_mm = .*/position_deviation_mm = 0.5/; s/^# *rotation_deviation_deg = .*/rotation_deviation_deg = 0.5/' session.toml
sed -i 's/^\[camera\]/[camera]\nturned_scope = "scope.json"/' session.toml
quiet check session.toml
quiet simulate heart.mcap "${common[@]}" --seed "$seed" --duration 32 --fps 15 --tracker-noise 0.5 --turn-to 40 \
  --zoom-to 1.07 --turn-at 15
quiet replay heart.mcap --lockstep --json true.json
quiet replay heart.mcap --lockstep -c session.toml --json measured.json
at_most "positions by the measured function, mm" "$(settled measured.json median_mm)" \
  "$(times 1.5 "$(settled true.json median_mm)")"
[ "$(settled measured.json count)" -gt 2000 ] || fail "hardly anything was mapped: $(cat measured.json)"
echo "as promised"
