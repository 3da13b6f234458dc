#!/bin/bash
# perimapd as a user runs it: publishes over DDS to another process without a gap, ends cleanly on a signal and at the
# recording's end, and says in one line what is wrong with a configuration or a recording.
# perimapd_live.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML [unmapped]
# `unmapped`: too slow to map in real time (sanitizers), so nothing is asked of what is published.
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4
export CYCLONEDDS_URI=file://$5
domain=$((40 + $$ % 150))
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "FAILED: $1"
  exit 1
}

printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %d\n' "$recording" $domain > "$work/good.toml"

"$perimap" watch --domain $domain --wait 60 --record "$work/received.mcap" > "$work/watch" 2>&1 &
watch=$!
"$perimapd" -c "$work/good.toml" 2> "$work/log" || fail "perimapd ended with $? at the recording's end: $(cat "$work/log")"
sleep 0.5
kill -INT $watch
wait $watch || fail "watch ended with $?: $(tail -n 5 "$work/watch")"
sent=$(grep -oE '[0-9]+ surfaces' "$work/log" | tail -n 1)
[ "${sent%% *}" -ge 100 ] || fail "published too little: $(cat "$work/log")"
grep -Eq "(^|[^0-9])$sent in .* 0 lost" "$work/watch" || fail "of $sent: $(tail -n 6 "$work/watch")"
if [ "${6:-}" != unmapped ]; then
  "$perimap" report "$recording" --samples "$work/received.mcap" --picture "$work/picture.svg" > "$work/report" 2>&1 ||
    fail "report ended with $?: $(cat "$work/report")"
  grep -q ' 0 missed' "$work/report" || fail "$(cat "$work/report")"
  grep -q '</svg>' "$work/picture.svg" || fail "no picture"
fi

for signal in INT TERM; do
  "$perimapd" -c "$work/good.toml" 2> "$work/log" &
  daemon=$!
  sleep 2
  kill -$signal $daemon
  wait $daemon
  status=$?
  [ $status -eq 0 ] || fail "SIG$signal: ended with $status: $(cat "$work/log")"
  grep -q stopped "$work/log" || fail "SIG$signal: $(cat "$work/log")"
done

# exits WHAT CODE PATTERN COMMAND...: one line on standard error that matches
exits() {
  local what=$1 code=$2 pattern=$3
  shift 3
  "$@" > /dev/null 2> "$work/error"
  local status=$?
  [ $status -eq $code ] || fail "$what: ended with $status, not $code: $(cat "$work/error")"
  [ "$(wc -l < "$work/error")" -eq 1 ] || fail "$what: not one line: $(cat "$work/error")"
  grep -Eq "$pattern" "$work/error" || fail "$what: $(cat "$work/error")"
}
printf 'version = 1\n[pipeline]\nworker = 2\n' > "$work/unknown.toml"
exits "unknown key" 2 "unknown.toml:3:1: key 'pipeline.worker'" "$perimapd" -c "$work/unknown.toml"
printf 'version = 1\n[replay]\nrecording = "none.mcap"\n' > "$work/missing.toml"
exits "missing recording" 2 "missing.toml:3:[0-9]+: key 'replay.recording'" "$perimapd" -c "$work/missing.toml"
exits "missing configuration" 2 "nowhere.toml" "$perimapd" -c "$work/nowhere.toml"

: > "$work/empty.mcap"
exits "empty recording" 1 "empty.mcap: byte 0: " "$perimap" replay "$work/empty.mcap" --lockstep
size=$(stat -c %s "$recording")
head -c $((size * 3 / 4)) "$recording" > "$work/cut.mcap"
exits "cut recording" 1 "cut.mcap: byte [0-9]+: " "$perimap" replay "$work/cut.mcap" --lockstep
"$perimap" replay "$work/cut.mcap" --lockstep --whole > "$work/whole" 2> "$work/error" ||
  fail "what is whole of a cut recording: ended with $?: $(cat "$work/error")"
grep -q 'byte [0-9]*: ' "$work/error" || fail "the damage is not told: $(cat "$work/error")"
grep -Eq '^[1-9][0-9]+ frames' "$work/whole" || fail "nothing was replayed: $(cat "$work/whole")"
rm -f "$work/cut.mcap"
echo "as promised"
