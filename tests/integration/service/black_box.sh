#!/bin/bash
# The black box of a perimapd that replays: killed at random instants it is as it was written each time, the next run
# goes on from it, a command is in it, it is its owner's alone, a run that ends leaves it whole, and what is changed in
# it afterwards is told. On a full disk everything else goes on, and it is whole.
# black_box.sh PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML KILLS
set -uo pipefail
perimapd=$1 perimap=$2 recording=$3 work=$4 kills=$6
export CYCLONEDDS_URI=file://$5
source "$(dirname "$0")/../emulated_devices.sh"
umask 000
box=$work/black-box

configure() { # FOLDER
  printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %s\n[blackbox]\nfolder = "%s"\nmaximum_MB = 64\n' \
    "$recording" $domain "$1"
  printf '[control]\nsocket = "%s"\n' "$short/control"
}
configure "$box" > "$work/perimapd.toml"
begin() {
  "$perimapd" -c "$work/perimapd.toml" 2>> "$work/log" &
  daemon=$!
  started+=($daemon)
}
until_true() {
  local _
  for _ in $(seq 300); do
    if eval "$1"; then return 0; fi
    sleep 0.05
  done
  fail "not within 15 s: $1; $(tail -n 3 "$work/log")"
}
whole() { "$perimap" verify-log "$@" > "$work/verified" 2>&1; }

for ((i = 1; i <= kills; i++)); do
  begin
  until_true '[ -e "$box/segment-00000001" ]'
  sleep "0.$(printf '%03d' $((RANDOM % 1000)))"
  kill -9 $daemon
  wait $daemon 2> /dev/null
  ended $daemon
  whole --open "$box" || fail "after kill $i: $(cat "$work/verified")"
  ! whole "$box" || fail "after kill $i it is said to be whole"
done

: > "$work/log"
begin
samples() {
  "$perimap" ctl --socket "$short/control" status 2> /dev/null | awk '$1 == "samples:" {v = $2} END {print v + 0}'
}
until_true '[ "$(samples)" -ge 20 ]'
"$perimap" ctl --socket "$short/control" new-patient > "$work/answer" 2>&1 || fail "$(cat "$work/answer")"
until_true 'grep -q "black box: .*, goes on from" "$work/log"'
kill -TERM $daemon
wait $daemon || fail "it ended with $?: $(tail -n 3 "$work/log")"
ended $daemon
whole "$box" || fail "after a run that has ended: $(cat "$work/verified")"
[ "$(find "$box" -perm /077 | wc -l)" -eq 0 ] || fail "others may read $(find "$box" -perm /077)"
"$perimap" verify-log --entries "$box" > "$work/entries" 2> /dev/null || fail "its entries: $(tail -n 1 "$work/entries")"
grep -q '"kind":"command".*"command":"new-patient"' "$work/entries" || fail "the command is not in it"
grep -q '"kind":"event".*has no end: the run before was killed' "$work/entries" || fail "no kill is an event in it"
for kind in configuration surface phase status log end; do
  grep -q "\"kind\":\"$kind\"" "$work/entries" || fail "nothing of kind $kind is in it"
done
# The digest that the log has told is one of it, and another is not.
digest=$(sed -n 's/.*black box: ended with \([0-9a-f]*\).*/\1/p' "$work/log")
whole --digest "$digest" "$box" || fail "the log's digest: $(cat "$work/verified")"
! whole --digest "${digest//[0-9]/a}" "$box" || fail "any digest is taken for one of it"
"$perimap" verify-log --recording "$work/shown.mcap" "$box" > "$work/verified" 2>&1 || fail "$(cat "$work/verified")"
surfaces=$(grep -c '"kind":"surface"' "$work/entries")

# What is changed is told by file, entry and byte.
last=$(find "$box" -name 'segment-*' | sort | tail -n 1)
cp "$last" "$work/before"
printf 'x' | dd of="$last" bs=1 seek=$(($(stat -c %s "$last") / 2)) conv=notrunc 2> /dev/null
! whole "$box" || fail "a changed byte is taken for whole"
grep -qE "$(basename "$last"): entry [0-9]+, byte [0-9]+: " "$work/verified" || fail "it is not told where: $(cat "$work/verified")"
cp "$work/before" "$last"
whole "$box" || fail "put back: $(cat "$work/verified")"

# Of a disk that is full it takes what it has, and everything else goes on.
if mkdir "$work/full" && mount -t tmpfs -o size=20m tmpfs "$work/full" 2> /dev/null; then
  trap 'kill -9 "${started[@]}" 2> /dev/null; umount "$work/full"; rm -rf "$short"' EXIT
  configure "$work/full/black-box" > "$work/perimapd.toml"
  : > "$work/log"
  begin
  until_true '[ -e "$work/full/black-box/segment-00000001" ]'
  dd if=/dev/zero of="$work/full/filler" bs=1M 2> /dev/null
  sleep 2
  kill -0 $daemon 2> /dev/null || fail "on a full disk it ended: $(tail -n 3 "$work/log")"
  kill -TERM $daemon
  wait $daemon || fail "on a full disk it ended with $?: $(tail -n 3 "$work/log")"
  ended $daemon
  whole "$work/full/black-box" || fail "on a full disk: $(cat "$work/verified")"
  full=", and a full disk"
fi
echo "$kills kills, $surfaces surfaces in the last minutes${full:-}; as promised"
