#!/bin/bash
# A preoperative model that lies where the organ is gives the published mesh its vertices and moves as the heart does;
# one that lies elsewhere gives none, and that is said.
# a_model_is_set_in_motion.sh PERIMAP WORK_FOLDER SEED
set -euo pipefail
perimap=$1 work=$2 seed=$3
. "$(dirname "$0")/folder.sh"

quiet simulate session.mcap --force --duration 26 --size 320x240 --seed "$seed" --tracker-noise 0 --shape-error 1 \
  --preoperative model
# The recording is not registered: the model is brought into its frame instead, by the true registration.
node - model/heart.ply model/truth.json << 'END'
const fs = require("fs");
const [ply, registration] = process.argv.slice(2);
const { translation_mm: t, rotation_wxyz: [w, x, y, z] } = JSON.parse(fs.readFileSync(registration));
const R = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
           [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
           [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
const write = (file, away) => {
  let body = false;
  fs.writeFileSync(file, fs.readFileSync(ply, "utf8").split("\n").map((line) => {
    const words = line.trim().split(/\s+/);
    if (line.startsWith("end_header")) body = true;
    if (!body || words.length !== 3 || line.startsWith("end_header")) return line;
    const d = words.map((word, i) => Number(word) - t[i]);
    return [0, 1, 2].map((j) => R[0][j] * d[0] + R[1][j] * d[1] + R[2][j] * d[2] + away).join(" ");
  }).join("\n"));
};
write("organ.ply", 0);
write("elsewhere.ply", 60);
END
configure() { printf 'version = 1\n[model]\nfile = "%s"\nphase = 0.75\nshape_mm = 1.0\nregistration_mm = 0.3\n' "$1" > "$2"; }
configure organ.ply organ.toml
configure elsewhere.ply elsewhere.toml

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

quiet replay --lockstep --config elsewhere.toml session.mcap --samples elsewhere.mcap --json elsewhere.json
grep 'none of its .* vertices is where the surface is seen' out || fail "a model elsewhere is not told: $(cat out)"
"$perimap" refine --from elsewhere.mcap --phase 0.75 --model model/heart.ply > out 2>&1 && fail "a mesh was published: $(cat out)"
echo "a model is set in motion"
