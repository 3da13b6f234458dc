#!/bin/bash
# perimapd over devices instead of a recording: an emulated NDI tracker on a TCP port, an emulated Cyton on a
# pseudo-terminal, the camera's frames from the recording that both play.
# devices_live.sh accuracy|unplugged PERIMAPD PERIMAP RECORDING WORK_FOLDER CYCLONEDDS_XML
#   accuracy   what a subscriber receives is as much and as good as with a replay of the recording, within 10 %
#   unplugged  both devices are unplugged again and again: it publishes on, says so, recovers each time, leaks nothing
set -uo pipefail
mode=$1 perimapd=$2 perimap=$3 recording=$4 work=$5
export CYCLONEDDS_URI=file://$6
source "$(dirname "$0")/../emulated_devices.sh"

# run CONFIGURATION RECEIVED: perimapd until the recording's end, with a subscriber
run() {
  "$perimap" watch --domain $domain --wait 60 --record "$2" > "$work/watch" 2>&1 &
  local watch=$!
  started+=($watch)
  # It is read at once; the daemon may take a while to begin.
  : > "$work/log"
  "$perimapd" -c "$1" 2>> "$work/log" &
  daemon=$!
  started+=($daemon)
  if [ "$mode" = unplugged ]; then watch_for_leaks; fi
  wait $daemon || fail "perimapd ended with $?: $(tail -n 5 "$work/log")"
  sleep 0.5
  kill -INT $watch
  wait $watch || fail "watch ended with $?: $(tail -n 5 "$work/watch")"
}

# until_recovered TIMES: or until perimapd has ended
until_recovered() {
  while [ "$(grep -c 'tracker: streaming' "$work/log")" -lt "$1" ] && kill -0 $daemon 2> /dev/null; do sleep 0.1; done
}

# After both devices have come and gone a few times, descriptors and memory stay what they are.
watch_for_leaks() {
  local fds_before fds_after rss_before rss_after
  # The buffers of the playback fill during the first seconds.
  until_recovered $((unplugs / 2))
  fds_before=$(find /proc/$daemon/fd 2> /dev/null | wc -l)
  rss_before=$(awk '/VmRSS/ {print $2}' /proc/$daemon/status)
  until_recovered "$unplugs"
  fds_after=$(find /proc/$daemon/fd 2> /dev/null | wc -l)
  rss_after=$(awk '/VmRSS/ {print $2}' /proc/$daemon/status 2> /dev/null || echo 0)
  echo "descriptors $fds_before then $fds_after, memory $rss_before then $rss_after kB"
  # Either link may be open or closed at the moment of counting.
  [ $((fds_after - fds_before)) -le 2 ] || fail "descriptors leak: $fds_before, then $fds_after"
  # Sanitizers keep what was freed for a while, and a few seconds are too short to tell growth from warming up.
  [ -n "${PERIMAP_SANITIZED:-}" ] || [ "$unplugs" -lt 20 ] || [ $((rss_after - rss_before)) -le 4096 ] || fail "memory leaks: $rss_before, then $rss_after kB"
}

faults=()
unplugs=4
if [ "$mode" = unplugged ]; then
  faults=(--unplug 1 0.25)
  [ "${7:-}" = "" ] || unplugs=$7
fi
emulate "$recording" "${faults[@]}"
devices_toml "$recording" > "$work/devices.toml"
run "$work/devices.toml" "$work/devices.mcap"
kill -INT $emulators
wait $emulators || fail "the emulators ended with $?: $(cat "$work/emulators")"
grep -q 'tracker: streaming: perimap emulated tracker' "$work/log" || fail "no tracker: $(cat "$work/log")"
grep -q 'ECG: streaming' "$work/log" || fail "no ECG: $(cat "$work/log")"
grep -Eq ' 0 lost' "$work/watch" || fail "surfaces were lost: $(tail -n 6 "$work/watch")"
sent=$(grep -oE '[0-9]+ surfaces' "$work/log" | tail -n 1)
frames=$(grep -oE '[0-9]+ frames' "$work/log" | tail -n 1)
[ "${sent%% *}" -ge "${frames%% *}" ] || fail "it did not publish on: $frames, $sent"

if [ "$mode" = unplugged ]; then
  for device in tracker ECG; do
    times=$(grep -c "$device: streaming" "$work/log")
    [ "$times" -ge "$unplugs" ] || fail "$device recovered $times times only: $(tail -n 20 "$work/log")"
    grep -q "$device: .*gone" "$work/log" || fail "$device: the log does not say that it went: $(cat "$work/log")"
  done
  echo "as promised: $sent, $unplugs recoveries and more"
  exit 0
fi

# The recording begins seconds after both were opened: a device that has nothing to send yet is waited for.
! grep -Eq 'ECG: .*((not one|sends no|no) sample|not a byte)' "$work/log" || fail "the ECG was opened again: $(cat "$work/log")"
for told in log watch; do mv "$work/$told" "$work/$told-devices"; done

printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %d\n' "$recording" $domain > "$work/replay.toml"
run "$work/replay.toml" "$work/replay.mcap"
for way in devices replay; do
  "$perimap" report "$recording" --samples "$work/$way.mcap" --json "$work/$way.json" > "$work/report-$way" 2>&1 ||
    fail "report ended with $?: $(cat "$work/report-$way")"
done
node - "$work/devices.json" "$work/replay.json" << 'END' || fail "worse than replay: $(cat "$work/log-devices")"
const [devices, replay] = process.argv.slice(2).map(f => JSON.parse(require("fs").readFileSync(f)).accuracy);
let failed = false;
const check = (ok, line) => {
  console.log(`${ok ? "ok  " : "FAIL"} ${line}`);
  failed ||= !ok;
};
// Errors of what is mapped say nothing of what is not: as much must be mapped, for as long.
const figures = {
  "median_mm": [t => t.settled_error.median_mm, "most"],
  "p95_mm": [t => t.settled_error.p95_mm, "most"],
  "positions": [t => t.settled_error.count, "least"],
  "positions of state good": [t => t.good_positions, "least"],
  "features converged": [t => t.features_converged, "least"],
  "surfaces": [t => t.surfaces_settled, "least"],
};
for (const [name, [of, bound]] of Object.entries(figures)) {
  const live = of(devices), replayed = of(replay);
  const ok = Number.isFinite(live) && replayed > 0 && (bound === "most" ? live <= 1.1 * replayed : live >= 0.9 * replayed);
  check(ok, `${name}: ${live} over devices, ${replayed} replayed`);
}
// A replay has none or next to none, of which 10 % is nothing: one in a hundred more is what a busy machine may cost.
const most = 1.1 * replay.surfaces_invalid + 0.01 * replay.surfaces_settled;
check(devices.surfaces_invalid <= most, `surfaces invalid: ${devices.surfaces_invalid} over devices, ${replay.surfaces_invalid} replayed`);
// What both lack is equal too.
check(replay.features_converged >= 20 && replay.settled_error.count >= 5000, "the replay maps the heart");
process.exit(failed ? 1 : 0);
END
