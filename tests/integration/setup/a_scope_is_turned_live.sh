#!/bin/bash
# An angled scope, measured at three turns from emulated devices while they run: the user is told at which turn it is
# held, what is missing there and when to turn on. Then perimapd maps a heart over the same devices while the scope is
# turned. The turn is told by the field stop in the pictures, or by a second tool of the tracker.
# a_scope_is_turned_live.sh PERIMAP PERIMAPD WORK_FOLDER SEED CYCLONEDDS_XML field-stop|second-sensor
set -uo pipefail
perimap=$1 perimapd=$2 work=$3 seed=$4 told_by=$6
export CYCLONEDDS_URI=file://$5
. "$(dirname "$0")/../emulated_devices.sh"
. "$(dirname "$0")/../figures.sh"
trap 'kill -9 "${started[@]}" 2> /dev/null; rm -rf "$short" "$work"/*.mcap' EXIT
cd "$work" || exit 1

quiet() { "$perimap" "$@" > out 2> told || fail "perimap $*: $(cat out told)"; }
settled() { tr -d ' \n' < "$1" | grep -o '"settled_error":{[^}]*' | grep -o "\"$2\":[0-9.e-]*" | cut -d: -f2; }

common=(--setup-seed "$seed" --size 640x480 --field-stop 0)
by=()
if [ "$told_by" = second-sensor ]; then
  common+=(--second-sensor)
  by=(--by-second-sensor)
fi

# ---- as held at first: lens, hand-eye and clocks
quiet simulate board.mcap --scene board "${common[@]}" --seed "$seed" --duration 30 --fps 15
quiet calibrate camera --from board.mcap --square-mm 8 --output camera.yaml
quiet calibrate hand-eye --from board.mcap --square-mm 8 --calibration camera.yaml --output hand-eye.json

# ---- the turns, one recording of all of them
quiet simulate turns.mcap --scene board "${common[@]}" --seed "$((seed + 1))" --duration 114 --fps 15 \
  --turn-to 75 --turn-at 36 --turn-to 150 --turn-at 76
quiet calibrate scope --from turns.mcap --square-mm 8 "${by[@]}" --output recorded.json --html scope.html
[ "$(tr -d ' \n' < recorded.json | grep -o '"from_s"' | wc -l)" -eq 3 ] || fail "three turns were held: $(cat out)"
at_most "left over, degrees" "$(number recorded.json left_over_deg)" 0.4
at_most "held aside, mm" "$(number recorded.json aside_mm)" 3
at_most "deviation of the hand-eye, mm" "$(number recorded.json translation_mm_deviation)" 1.5
grep -q '<svg' scope.html || fail "the page has no pictures"

# ---- likewise from devices, guided
emulate turns.mcap --ndi-tools 1
devices_toml "$work/turns.mcap" | sed 's/^\[tracker\]/[tracker]\nsensor = "0A"\nsecond_sensor = "0D"/' > devices.toml
[ "$told_by" = second-sensor ] || sed -i '/^second_sensor/d' devices.toml
sed -i "s/^\[camera\]/[camera]\ncalibration = \"camera.yaml\"/" devices.toml
cp devices.toml before.toml
"$perimap" calibrate scope --live devices.toml --square-mm 8 "${by[@]}" --output scope.json --configuration devices.toml \
  --seconds 126 > out 2> told || fail "calibrate scope --live: $(cat out told)"
for words in 'turn 1 of 3: ' 'turn 2 of 3: ' 'turn the scope in its camera head by 60 degrees' 'turned [0-9]* [0-9]* [0-9]* degrees about three axes\|show it'; do
  grep -q "$words" told || fail "it was not told: $words: $(cat told)"
done
grep -q '^turned_scope = "scope.json"' devices.toml || fail "the configuration does not name the scope"
grep -q '"sensor": "0A"' scope.json || fail "the result does not say of which sensor it is"
at_most "live: left over, degrees" "$(number scope.json left_over_deg)" 0.4
at_most "live: deviation of the hand-eye, mm" "$(number scope.json translation_mm_deviation)" 1.5
kill "$emulators"
wait "$emulators"
ended "$emulators"

# ---- refused before anything is recorded
if [ "$told_by" = second-sensor ]; then
  sed '/^second_sensor/d; /^turned_scope/d' devices.toml > alone.toml
  "$perimap" calibrate scope --live alone.toml --square-mm 8 --by-second-sensor > out 2> told
  [ $? -eq 2 ] && grep -q 'names no tracker.second_sensor' told || fail "no second sensor: $(cat out told)"
fi

# ---- perimapd over the devices, the scope turned meanwhile
quiet simulate heart.mcap "${common[@]}" --seed "$seed" --duration 30 --fps 15 --tracker-noise 0.5 --turn-to 55 --turn-at 16
emulate heart.mcap --ndi-tools 1
sed -i "s/^playback_start_s = .*/playback_start_s = $start/; s|^playback = .*|playback = \"$work/heart.mcap\"|" devices.toml
noise="position_deviation_mm = 0.5\\nrotation_deviation_deg = 0.5"
sed -i "s/^\[tracker\]/[tracker]\n$noise\ntime_offset_ms = $(number hand-eye.json time_offset_ms)/" devices.toml
"$perimap" watch --domain $domain --wait 60 --record received.mcap > watched 2>&1 &
watch=$!
started+=($watch)
"$perimapd" -c devices.toml 2> log || fail "perimapd ended with $?: $(tail -n 5 log)"
sleep 0.5
kill -INT $watch
wait $watch || fail "watch ended with $?: $(tail -n 5 watched)"
quiet report heart.mcap --samples received.mcap --json report.json
quiet replay heart.mcap --lockstep --json true.json
at_most "positions received, median, mm" "$(settled report.json median_mm)" \
  "$(awk -v true="$(settled true.json median_mm)" 'BEGIN { print 1.5 * true }')"
[ "$(settled report.json count)" -gt 2000 ] || fail "hardly anything was mapped: $(cat report.json)"
grep -q 'the scope is turned by 5[45]' log || fail "perimapd did not read the turn: $(cat log)"
echo "as promised"
