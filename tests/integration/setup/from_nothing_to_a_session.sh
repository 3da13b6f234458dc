#!/bin/bash
# From an unknown set-up to a session: what is drawn by a seed is calibrated from recordings alone, verified, and used to
# map a heart. Positions must be as good, within 1.3 times, as the true set-up makes them.
# from_nothing_to_a_session.sh PERIMAP WORK_FOLDER SEED
set -euo pipefail
perimap=$1 work=$2 seed=$3
rm -rf "$work"
mkdir -p "$work"
cd "$work"
trap 'rm -f "$work"/*.mcap' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}
quiet() { "$perimap" "$@" > out 2> errors || fail "perimap $*: $(cat out errors)"; }
# number FILE KEY: the first number of a key in JSON.
number() { tr -d ' \n' < "$1" | grep -o "\"$2\":\[*-*[0-9.e+-]*" | head -1 | sed 's/.*[:[]//'; }
# at_most WHAT VALUE BOUND
at_most() {
  awk -v v="$2" -v b="$3" 'BEGIN { exit !(v != "" && v + 0 <= b + 0) }' || fail "$1: $2, expected at most $3"
  echo "$1: $2 (at most $3)"
}

# ---- what is there: a bench with a board, the scope at rest, landmarks, and then the heart
common=(--setup-seed "$seed" --size 640x480)
quiet simulate board.mcap --scene board "${common[@]}" --seed "$seed" --duration 40 --fps 15 --truth truth.json \
  --landmarks image.csv
quiet simulate check.mcap --scene board "${common[@]}" --seed "$((seed + 1000))" --duration 12 --fps 15
quiet simulate still.mcap --scene still "${common[@]}" --seed "$seed" --duration 60
quiet simulate landmarks.mcap --scene landmarks "${common[@]}" --seed "$seed"

# ---- measure it
quiet setup --output devices.toml --camera none --tracker none --ecg none --seconds 0
quiet calibrate camera --from board.mcap --square-mm 8 --output camera.yaml --configuration devices.toml --json
cp out camera.json
quiet calibrate hand-eye --from board.mcap --square-mm 8 --configuration devices.toml --html hand-eye.html --json
cp out hand-eye.json
quiet calibrate time --from board.mcap --square-mm 8 --configuration devices.toml --json
cp out time.json
quiet calibrate tool --from board.mcap --output pointer.json
quiet calibrate tracker --from still.mcap --configuration devices.toml --json
cp out tracker.json
quiet register --model image.csv --from landmarks.mcap --tip pointer.json --output registration.json
quiet check devices.toml

# ---- is it right?
quiet verify devices.toml --from check.mcap --square-mm 8 --tip pointer.json --bound-mm 2 --output verified.json
grep -q '"passed": true' verified.json || fail "verify passed, and its record says otherwise"
sed 's/^hand_eye_translation_SC_mm = .*/hand_eye_translation_SC_mm = [40.0, 0.0, 30.0]/' devices.toml > wrong.toml
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
