#!/bin/bash
# perimapd is killed again and again while tracker and ECG, outside it, go on, the camera's frames come at their times,
# and all of it is recorded: each time it publishes valid positions again from its checkpoint, what was received is as good
# as it should be, and what was recorded is readable. With DDS Security, a page that shows it, and a black box, which is as
# it was written after each kill.
# killed.sh PERIMAPD PERIMAP CHECK RECORDING WORK_FOLDER CYCLONEDDS_XML KILLS
set -uo pipefail
perimapd=$1 perimap=$2 check=$3 recording=$4 work=$5 kills=$7
export CYCLONEDDS_URI=file://$6
source "$(dirname "$0")/../emulated_devices.sh"

keys=$work/keys
for make in "init" "issue publisher theatre" "issue display navigation" "issue display page"; do
  # shellcheck disable=SC2086 # a command and its words
  "$perimap" keys $make --directory "$keys" > "$work/keys-made" 2>&1 || fail "keys $make: $(cat "$work/keys-made")"
done
box=$work/black-box
emulate "$recording"
mkdir "$work/recorded"
{
  devices_toml "$recording"  # up to its section of DDS
  printf 'security = "%s"\n' "$keys/theatre"
  printf '[control]\nsocket = "%s"\n[checkpoint]\nfile = "%s"\ninterval_s = 0.5\n' "$short/control" "$work/checkpoint"
  printf '[blackbox]\nfolder = "%s"\n' "$box"
  printf '[recording]\nrecord = true\nfolder = "recorded"\nmemory_MB = 32\n'
} > "$work/devices.toml"
"$perimap" view --domain $domain --security "$keys/page" --port 0 > "$work/view" 2>&1 &
started+=($!)
"$perimap" watch --domain $domain --security "$keys/navigation" --wait 60 --record "$work/received.mcap" > "$work/watch" 2>&1 &
watch=$!
started+=($watch)

: > "$work/log"
: > "$work/kills"
# What the runs so far have recorded; of those that are over nobody may touch it any more.
recorded() { find "$work/recorded" -type f -printf '%f %s %T@\n' | sort; }
now() { awk '{print $1}' /proc/uptime; }
# One figure of the daemon's status; 0 while it does not answer.
status() { "$perimap" ctl --socket "$short/control" status 2> /dev/null | awk -v key="$1:" '$1 == key {v = $2} END {print v + 0}'; }
begin() {
  "$perimapd" -c "$work/devices.toml" 2>> "$work/log" &
  daemon=$!
  started+=($daemon)
}

begin
until [ "$(status features_converged)" -ge 20 ]; do
  kill -0 $daemon 2> /dev/null || fail "it ended before it had mapped: $(tail -n 3 "$work/log")"
  sleep 0.3
done
sleep 2
for ((i = 1; i <= kills; i++)); do
  kill -9 $daemon 2> /dev/null || fail "before kill $i it had ended by itself: $(tail -n 3 "$work/log")"
  wait $daemon 2> /dev/null
  was=$(now)
  recorded > "$work/left-$i"
  # The newest segment alone, in some milliseconds: a surface is due in a second. The next run vouches for it.
  newest=$(find "$box" -name 'segment-????????' | sort | tail -n 1)
  "$perimap" verify-log --open "$newest" > "$work/verified" 2>&1 || fail "black box after kill $i: $(cat "$work/verified")"
  echo "$was $(now)" >> "$work/kills"
  begin
  until [ "$(status samples)" -gt 0 ]; do
    kill -0 $daemon 2> /dev/null || fail "after kill $i it did not come back: $(tail -n 3 "$work/log")"
    sleep 0.02
  done
  # What an ECG hides while nobody listens takes some beats to come back.
  sleep "$((1 + RANDOM % 6)).$((RANDOM % 10))"
done
page=$(grep -oE 'http://[^ ]+' "$work/view" | head -n 1)
node -e 'fetch(process.argv[1]).then((r) => process.exit(r.ok ? 0 : 1))' "$page" ||
  fail "the page is gone: $(tail -n 3 "$work/view")"
converged=$(status features_converged)
kill -TERM $daemon
wait $daemon || fail "it ended with $?: $(tail -n 3 "$work/log")"
sleep 0.5
kill -INT $watch
wait $watch || fail "watch: $(tail -n 5 "$work/watch")"
"$perimap" verify-log "$box" > "$work/verified" 2>&1 || fail "black box at the end: $(cat "$work/verified")"
noted=$(grep -c 'has no end, as the next run found it' "$work/verified")
# A kill may fall between two segments, where nothing lacks its end.
[ "$noted" -ge $((kills - 1)) ] || fail "of $kills kills the black box tells $noted"
tail -n 1 "$work/verified"
echo "$kills kills; $converged features converged at the end"
recorded > "$work/left-at-the-end"
for ((i = 1; i <= kills; i++)); do
  [ -z "$(comm -23 "$work/left-$i" "$work/left-at-the-end")" ] || fail "what was recorded before kill $i has changed"
done
"$check" "$work/received.mcap" "$work/kills" "$work/recorded" || fail "what was published or recorded is wrong"

resumed=$(grep -Ec 'going on from .*: [1-9][0-9]+ features' "$work/log")
[ "$resumed" -eq "$kills" ] || fail "it went on from its checkpoint $resumed times of $kills: $(grep -E 'going on|starts empty' "$work/log")"
[ "$converged" -ge 20 ] || fail "the map is gone: $(tail -n 20 "$work/log")"
"$perimap" report "$recording" --samples "$work/received.mcap" --json "$work/report.json" > "$work/report" 2>&1 ||
  fail "report: $(cat "$work/report")"
node - "$work/report.json" << 'END' || fail "what was received is wrong"
const a = JSON.parse(require("fs").readFileSync(process.argv[2])).accuracy;
const e = a.settled_error;
console.log(`settled: ${e.count} positions, median ${e.median_mm} mm, 95 % ${e.p95_mm} mm, NEES/3 ${a.settled_mean_nees}`);
console.log(`good: ${a.good_positions} positions, ${a.good_positions_off} off by more than 3 mm, NEES/3 ${a.good_positions_mean_nees}`);
// A kill hides beats, some of them premature: until the next ones the phase is uncertain, and no surface good.
process.exit(e.count > 1000 && e.median_mm < 1 && a.good_positions > 1000 && a.good_positions_mean_nees < 2 &&
  a.settled_mean_nees < 12 && a.good_positions_off === 0 ? 0 : 1);
END

# Of another set-up it takes nothing.
sed -i 's/^\[ecg\]/hand_eye_translation_SC_mm = [1.0, 2.0, 3.0]\n[ecg]/' "$work/devices.toml"
begin
until [ "$(status version | wc -l)" -gt 0 ] && grep -q 'another hand-eye' "$work/log"; do
  kill -0 $daemon 2> /dev/null || fail "with another set-up it ended: $(tail -n 3 "$work/log")"
  sleep 0.1
done
[ "$(status features_converged)" -eq 0 ] || fail "it went on from another set-up"
kill -TERM $daemon
wait $daemon
[ "$(find "$work" -name 'checkpoint*' | wc -l)" -le 2 ] || fail "it leaves files: $(ls "$work")"
echo "as promised"
