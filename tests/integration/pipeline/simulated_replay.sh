#!/bin/bash
# A session that is replayed as it is rendered gives the samples and the report of its recording, byte by byte, for any
# number of workers and rendering threads; nothing is left of it; what is no such session is refused.
# simulated_replay.sh PERIMAP WORK_FOLDER
set -euo pipefail
perimap=$1 work=$2
fail() {
  echo "FAILED: $1" >&2
  cat "$work/out" "$work/err" >&2 || true
  exit 1
}
rm -rf "$work"
mkdir -p "$work/tmp"
cd "$work"
export TMPDIR=$work/tmp
replay() { "$perimap" replay --lockstep "$@" > out 2> err || fail "replay $*"; }
# The report but for how long the stages took, what names the recording, and the number of workers.
figures() { tr -d ' \n' < "$1" | sed -E 's/"stages":\{("[^"]*":\{[^}]*\},?)*\}//; s/"(recording|simulated)":"[^"]*",?//; s/"workers":[0-9]*,?//'; }

cat > script.toml << 'END'
version = 1
[[event]]
kind = "smoke"
at_s = 15
for_s = 1
density = 1.0
[[event]]
kind = "leads-off"
at_s = 17
for_s = 1
END
# compare NAME OPTIONS TIMES...: each of TIMES is WORKERS/THREADS
compare() {
  local name=$1 options=$2 times
  # shellcheck disable=SC2086
  "$perimap" simulate "$name.mcap" $options > out 2> err || fail "simulate $options"
  replay "$name.mcap" --workers 1 --samples "$name-samples.mcap" --json "$name.json"
  for times in "${@:3}"; do
    replay --simulated "$options --threads ${times#*/}" --workers "${times%/*}" --samples without.mcap --json without.json
    cmp "$name-samples.mcap" without.mcap || fail "$name: the samples differ with workers and threads $times"
    grep -q '"simulated": "--size' without.json || fail "the report does not say what was simulated"
    cmp <(figures "$name.json") <(figures without.json) || fail "$name: the reports differ with workers and threads $times"
  done
  rm "$name.mcap"
}
compare noisy "--size 320x240 --fps 15 --duration 20 --seed 3 --procedure script.toml --patient-tool --instrument" 1/3 2/1 4/2
compare exact "--size 320x240 --fps 15 --duration 16 --seed 4 --tracker-noise 0 --field-stop 30 --second-sensor --turn-to 50 --turn-at 12" 2/2
compare breathing "--size 320x240 --fps 10 --duration 5 --seed 5 --respiration 5 --respiration-channel" 2/2
for name in noisy exact; do grep -q '"accuracy"' $name.json || fail "$name: nothing was published"; done
grep -q '"kind": "smoke"' noisy.json || fail "the procedure has no score"

# Stopped early, it reports what there was; nothing is left then either.
timeout --preserve-status -s INT 2 "$perimap" replay --lockstep --simulated "--size 320x240 --duration 600" > out 2> err || fail "a signal is no failure"
grep -q '^stopped early' out || fail "a stopped replay says so"
[ -z "$(ls "$TMPDIR")" ] || fail "something is left: $(ls "$TMPDIR")"

# refuses WORDS ARGUMENT...
refuses() {
  local got=0
  "$perimap" replay "${@:2}" > out 2> err || got=$?
  [ "$got" -eq 2 ] && grep -q -e "$1" err || fail "${*:2}: ended with $got, expected 2 and '$1'"
}
refuses 'expected --lockstep' --simulated "--duration 3"
refuses 'either RECORDING or --simulated' --lockstep
refuses 'either RECORDING or --simulated' --lockstep x.mcap --simulated "--duration 3"
refuses '--whole: expected RECORDING' --lockstep --whole --simulated "--duration 3"
refuses '--simulated: --force: expected' --lockstep --simulated "--force"
refuses '--simulated: .*duration' --lockstep --simulated "--duration 0"
[ -z "$(ls "$TMPDIR")" ] || fail "something is left of what was refused"
