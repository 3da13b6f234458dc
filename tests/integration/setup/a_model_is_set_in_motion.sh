#!/bin/bash
# A preoperative model that lies where the organ is gives the published mesh its vertices and moves as the heart does;
# one that lies elsewhere gives none, and that is said. One of several phases moves where nobody looks as well, though
# its motion comes a fifth of a cycle early.
# a_model_is_set_in_motion.sh PERIMAP WORK_FOLDER SEED
set -euo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/folder.sh"

quiet simulate session.mcap --force --duration 26 --size 320x240 --seed "$seed" --tracker-noise 0 --shape-error 1 \
  --preoperative model --model-phases 10 --model-shift 0.2
# The recording is not registered: the model is brought into its frame instead, by the true registration.
node - model << 'END'
const fs = require("fs");
const [folder] = process.argv.slice(2);
const registration = folder + "/truth.json";
const { translation_mm: t, rotation_wxyz: [w, x, y, z] } = JSON.parse(fs.readFileSync(registration));
const R = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
           [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
           [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
const write = (ply, file, away) => {
  let body = false;
  fs.writeFileSync(file, fs.readFileSync(folder + "/" + ply, "utf8").split("\n").map((line) => {
    const words = line.trim().split(/\s+/);
    if (line.startsWith("end_header")) body = true;
    if (!body || words.length !== 3 || line.startsWith("end_header")) return line;
    const d = words.map((word, i) => Number(word) - t[i]);
    return [0, 1, 2].map((j) => R[0][j] * d[0] + R[1][j] * d[1] + R[2][j] * d[2] + away).join(" ");
  }).join("\n"));
};
write("heart.ply", "organ.ply", 0);
for (let k = 1; k < 10; ++k) write(`heart_${k}.ply`, `organ_${k}.ply`, 0);
write("heart.ply", "elsewhere.ply", 60);
END
configure() { printf 'version = 1\n[model]\nfile = "%s"\nphase = 0.75\nshape_mm = 1.0\nregistration_mm = 0.3\n' "$1" > "$2"; }
configure organ.ply organ.toml
configure elsewhere.ply elsewhere.toml
sed 's/"heart/"organ/g; s/^phase/registration_mm = 0.3\nphase/' model/model.toml > moving.toml

model() { node -p "const m = JSON.parse(require('fs').readFileSync('$1')).surface.model; m?.$2 ?? ''"; }
for workers in 1 2; do
  quiet replay --lockstep --workers $workers --config organ.toml session.mcap --samples organ$workers.mcap --json organ.json
done
cp out told
cmp organ1.mcap organ2.mcap || fail "what is published depends on the number of workers"
grep 'model:' told || fail "nothing is said of the model: $(cat told)"
at_most "distance of the model from the heart's surface, mm RMS" "$(model organ.json rms_mm)" 0.6
at_most "its NEES along the normal" "$(model organ.json nees)" 2
at_least "vertices that are supported" "$(model organ.json supported)" 100

for workers in 1 3; do
  quiet replay --lockstep --workers $workers --config moving.toml session.mcap --samples moving$workers.mcap --json moving.json
done
grep 'its own motion has 4 harmonics' out || fail "nothing is said of the model's motion: $(cat out)"
cmp moving1.mcap moving3.mcap || fail "what is published depends on the number of workers"
at_most "distance of a model that moves, mm RMS" "$(model moving.json rms_mm)" 0.6
at_most "its NEES along the normal" "$(model moving.json nees)" 2
at_most "distance where no feature tells anything, beside that of one that does not move" \
  "$(node -p "$(model moving.json unseen_rms_mm) / $(model organ.json unseen_rms_mm)")" 0.8
at_most "NEES there" "$(model moving.json unseen_nees)" 2
sed 's/"organ_3.ply"/"model\/other_heart.ply"/' moving.toml > mixed.toml
"$perimap" replay --lockstep --config mixed.toml session.mcap > out 2>&1 && fail "another mesh was taken for a phase"
grep "model.other_files.*other_heart.ply: expected the mesh of .*organ.ply at another phase, with .* vertices" out ||
  fail "what is wrong with it is not told: $(cat out)"

quiet replay --lockstep --config elsewhere.toml session.mcap --samples elsewhere.mcap --json elsewhere.json
grep 'none of its .* vertices is where the surface is seen' out || fail "a model elsewhere is not told: $(cat out)"
"$perimap" refine --from elsewhere.mcap --phase 0.75 --model model/heart.ply > out 2>&1 && fail "a mesh was published: $(cat out)"
echo "a model is set in motion"
