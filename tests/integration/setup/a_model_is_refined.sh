#!/bin/bash
# A preoperative model that is registered 3 mm and 3 degrees off is fitted to the surface that a session published, by
# what the guide says; another heart, a mirrored one and one in metres are not taken for it.
# a_model_is_refined.sh PERIMAP WORK_FOLDER SEED
set -euo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/folder.sh"

refused() { # EXPECTED COMMAND...
  local expected=$1
  shift
  if "$perimap" "$@" > out 2> errors; then fail "perimap $* is taken: $(cat out)"; fi
  grep -q "$expected" errors || fail "perimap $*: $(cat errors), expected: $expected"
  echo "refused: $(cat errors)"
}

for shape in 0 2; do
  quiet simulate session.mcap --force --duration 24 --size 320x240 --seed "$seed" --tracker-noise 0 --shape-error $shape \
    --preoperative model$shape
done
quiet replay --lockstep --samples published.mcap session.mcap
refine=(refine --from published.mcap --phase 0.75)

# ---- the exact shape, and one that is not
quiet "${refine[@]}" --model model0/heart.ply --registration model0/start.json --shape-mm 0.3 --compare model0/truth.json \
  --json
cp out exact.json
at_most "true error at the organ with the exact shape, mm" "$(number exact.json rms_mm)" 1.5
quiet "${refine[@]}" --model model2/heart.ply --registration model2/start.json --shape-mm 2 --compare model2/truth.json \
  --json --output refined.json
cp out rough.json
at_most "its NEES with 2 mm of shape error" "$(number rough.json nees)" 4

# ---- a configuration takes it over, and a session that was registered by it starts there
printf 'version = 1\n\n[tracker]\n' > devices.toml
quiet "${refine[@]}" --model model0/heart.ply --registration model0/start.json --shape-mm 0.3 --configuration devices.toml
grep -q '^registration_translation_IW_mm = ' devices.toml || fail "no key is set: $(cat devices.toml)"

# ---- wrong ones
"$perimap" "${refine[@]}" --model model0/other_heart.ply --registration model0/start.json --shape-mm 0.3 > out 2>&1 &&
  { grep -q DOUBTED out || fail "another heart is taken: $(cat out)"; }
echo "another heart: $(cat out)"
awk '/^end_header/ { body = 1; print; next } body && NF == 3 { print -$1, $2, $3; next } { print }' model0/heart.ply \
  > mirrored.ply
refused 'mirrored' "${refine[@]}" --model mirrored.ply --registration model0/start.json
refused 'are its lengths in mm' "${refine[@]}" --model model0/heart.ply --registration model0/start.json --unit m
head -c 20000 model0/heart.ply > cut.ply
refused "cut.ply:" "${refine[@]}" --model cut.ply --registration model0/start.json
refused 'no surface was recorded' refine --from session.mcap --phase 0.75 --model model0/heart.ply
refused 'faces the other way\|meet the model\|another shape' "${refine[@]}" --model model0/heart.ply
echo "a model is refined"
