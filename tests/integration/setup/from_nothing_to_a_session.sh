#!/bin/bash
# From an unknown set-up to a session: what is drawn by a seed is calibrated from recordings alone, verified, and used to
# map a heart. Positions must be as good, within 1.3 times, as the true set-up makes them.
# from_nothing_to_a_session.sh PERIMAP WORK_FOLDER SEED
set -euo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/folder.sh"

# ---- what is there: a bench with a board, the scope at rest, landmarks, and then the heart
common=(--setup-seed "$seed" --size 640x480)
quiet simulate board.mcap --scene board "${common[@]}" --seed "$seed" --duration 40 --fps 15 --truth truth.json \
  --landmarks image.csv
quiet simulate check.mcap --scene board "${common[@]}" --seed "$((seed + 1000))" --duration 12 --fps 15
quiet simulate still.mcap --scene still "${common[@]}" --seed "$seed" --duration 60
quiet simulate landmarks.mcap --scene landmarks "${common[@]}" --seed "$seed"

quiet simulate stop.mcap --scene board "${common[@]}" --seed "$seed" --duration 2 --fps 5 --field-stop 40

# ---- measure it; what each command shows and prints stays, for the browser (pages_open_in_a_browser.sh)
mkdir pages
shown() { # NAME COMMAND...
  local name=$1
  shift
  quiet "$@" --html "pages/$name.html" --json
  cp out "pages/$name.json"
  cp out "$name.json"
}
quiet setup --output devices.toml --camera none --tracker none --ecg none --seconds 0
shown camera calibrate camera --from board.mcap --square-mm 8 --output camera.yaml --configuration devices.toml
shown hand-eye calibrate hand-eye --from board.mcap --square-mm 8 --configuration devices.toml
shown time calibrate time --from board.mcap --square-mm 8 --configuration devices.toml
shown tool calibrate tool --from board.mcap --output pointer.json --configuration devices.toml
shown tracker calibrate tracker --from still.mcap --configuration devices.toml
shown scope calibrate scope --from stop.mcap
shown register register --model image.csv --from landmarks.mcap --tip pointer.json --output registration.json \
  --configuration devices.toml
grep -q '^pointer_calibration = "pointer.json"' devices.toml || fail "the configuration does not name the tip"
grep -q '^registration_translation_IW_mm' devices.toml || fail "the configuration has no registration"
quiet check devices.toml
# Without what OpenCV's solvers make of it.
tr -d ' \n' < hand-eye.json | sed 's/"opencv":.*}},//' > ours.json
for i in 1 2; do
  near "focal length $i, px" "$(nth camera.json focal_px $i)" "$(nth truth.json focal_px $i)" 2.2
  near "principal point $i, px" "$(nth camera.json principal_point_px $i)" "$(nth truth.json principal_point_px $i)" 1.4
done
for i in 1 2 3; do
  near "hand-eye translation $i, mm" "$(nth ours.json translation_mm $i)" "$(nth truth.json translation_mm $i)" 0.5
  near "pointer's tip $i, mm" "$(nth pointer.json tip_mm $i)" "$(nth truth.json tip_mm $i)" 0.3
done
near "time offset, ms" "$(number time.json time_offset_ms)" "$(number truth.json time_offset_ms)" 2
near "tracker's position noise, mm" "$(number tracker.json position_deviation_mm)" 1.4 0.21
near "tracker's rotation noise, degrees" "$(number tracker.json rotation_deviation_deg)" 0.5 0.075
# Where the landmarks are, not at the far origin: each as the others have it.
at_most "registration, mm left over" "$(number registration.json fre_mm)" 0.5

# ---- is it right?
shown verify verify devices.toml --from check.mcap --square-mm 8 --tip pointer.json --bound-mm 2 --output verified.json
grep -q '"passed": true' verified.json || fail "verify passed, and its record says otherwise"
sed 's/^hand_eye_translation_SC_mm = .*/hand_eye_translation_SC_mm = [40.0, 0.0, 30.0]/' devices.toml > wrong.toml
sed 's/^time_offset_ms = .*/time_offset_ms = 250.0/' devices.toml > late.toml
if "$perimap" verify late.toml --from check.mcap --square-mm 8 --bound-mm 2 > out 2> errors; then
  fail "verify lets clocks pass that are off by 0.2 s: $(cat out)"
fi
if "$perimap" verify wrong.toml --from check.mcap --square-mm 8 --tip pointer.json --bound-mm 2 > out 2> errors; then
  fail "verify lets a wrong hand-eye pass: $(grep hand_eye_translation wrong.toml; cat out)"
fi

# ---- use it
quiet simulate heart.mcap "${common[@]}" --seed "$seed" --duration 40
quiet replay heart.mcap --lockstep --json true.json
quiet replay heart.mcap --lockstep -c devices.toml --json measured.json
true_mm=$(tr -d ' \n' < true.json | grep -o '"settled_error":{[^}]*' | grep -o '"median_mm":[0-9.e-]*' | cut -d: -f2)
mm=$(tr -d ' \n' < measured.json | grep -o '"settled_error":{[^}]*' | grep -o '"median_mm":[0-9.e-]*' | cut -d: -f2)
echo "positions by the true set-up: $true_mm mm; NEES $(number true.json settled_mean_nees), measured $(number measured.json settled_mean_nees)"
at_most "positions by the measured set-up, mm" "$mm" "$(awk -v t="$true_mm" 'BEGIN { print 1.3 * t }')"
