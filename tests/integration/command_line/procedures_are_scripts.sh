#!/bin/bash
# What perimap simulate does with a procedure: a script that is drawn is written, read back and gives the same recording;
# what is wrong with one is told by file, line and key; the recording tells of the events, and replay --json scores them.
# procedures_are_scripts.sh PERIMAP WORK_FOLDER
set -euo pipefail
perimap=$1 work=$2
fail() {
  echo "FAILED: $1" >&2
  exit 1
}
rm -rf "$work"
mkdir -p "$work"
cd "$work"
simulate() { "$perimap" simulate "$@" --size 64x64 --fps 5 > out.txt 2> err.txt; }

simulate drawn.mcap --duration 150 --procedure draw:5 --write-procedure drawn.toml || { cat err.txt; fail "a drawn procedure"; }
grep -q '^\[\[event\]\]' drawn.toml || fail "nothing was drawn"
simulate again.mcap --duration 150 --procedure drawn.toml
cmp drawn.mcap again.mcap || fail "read back, the drawn procedure is another"
simulate plain.mcap --duration 3
echo 'version = 1' > nothing.toml
simulate nothing.mcap --duration 3 --procedure nothing.toml
cmp plain.mcap nothing.mcap ||
  fail "a procedure in which nothing happens changes the recording"

printf 'version = 1\n[[event]]\nkind = "smok"\nat_s = 1\nfor_s = 1\n' > wrong.toml
simulate wrong.mcap --duration 10 --procedure wrong.toml && fail "a wrong kind was taken"
grep -q "wrong.toml:3:8: key 'event\[1\].kind'.*did you mean 'smoke'" err.txt || { cat err.txt; fail "a wrong kind's words"; }
simulate wrong.mcap --duration 10 --procedure draw:x && fail "a wrong seed was taken"
grep -q "draw:SEED" err.txt || { cat err.txt; fail "a wrong seed's words"; }
simulate wrong.mcap --duration 10 --procedure nowhere.toml && fail "a missing file was taken"
grep -q "nowhere.toml" err.txt || { cat err.txt; fail "a missing file's words"; }
simulate wrong.mcap --duration 10 --write-procedure x.toml && fail "a script of nothing was written"
simulate wrong.mcap --scene board --procedure draw:1 && fail "a bench had a procedure"
[ ! -e wrong.mcap ] || fail "a recording was written for what is wrong"

printf 'version = 1\n[[event]]\nkind = "leads-off"\nat_s = 9\nfor_s = 2\n' > short.toml
"$perimap" simulate short.mcap --duration 14 --size 160x120 --fps 15 --seed 4 --tracker-noise 0 --procedure short.toml > out.txt 2>&1
"$perimap" replay short.mcap --lockstep --json short.json > replay.txt 2> err.txt || { cat err.txt; fail "replay"; }
for key in availability false_alarms_per_hour wrong_while_good_s cause_accuracy told_after_s good_again_after_s; do
  grep -q "\"$key\"" short.json || fail "the report has no $key"
done
grep -q 'leads-off' replay.txt || fail "the text has no row for the event"
"$perimap" replay plain.mcap --lockstep --json plain.json > replay.txt 2> err.txt
grep -q '"procedure"' plain.json && fail "a session without a procedure has a score of one"
exit 0
