#!/bin/bash
# The example subscriber builds against what is installed, by itself, and draws the surface where it is.
# overlay.sh BUILD_FOLDER EXAMPLE_FOLDER OVERLAY_CHECK WORK_FOLDER CYCLONEDDS_XML
set -uo pipefail
build=$1 example=$2 check=$3 work=$4
export CYCLONEDDS_URI=file://$5
domain=$((40 + $$ % 150))
mkdir -p "$work"
rm -rf "$work/root"
fail() {
  echo "FAILED: $1"
  exit 1
}

DESTDIR=$work/root cmake --install "$build" > "$work/install" 2>&1 || fail "installation: $(tail -n 5 "$work/install")"
prefix=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' "$build/CMakeCache.txt")
cmake -S "$example" -B "$work/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" \
  -DCMAKE_PREFIX_PATH="$work/root$prefix" > "$work/cmake" 2>&1 || fail "the example is not configured: $(tail -n 20 "$work/cmake")"
cmake --build "$work/build" > "$work/make" 2>&1 || fail "the example does not build: $(tail -n 40 "$work/make")"

# drawn NAME OPTION...: beside a perimapd on a recording that is simulated so. An exact tracker, so that what is off is the
# example's fault or the map's.
drawn() {
  recording=$work/$1.mcap
  shift
  "$build/daemon/perimap" simulate "$recording" --force --size 320x240 --tracker-noise 0 "$@" > "$work/simulate" 2>&1 ||
    fail "no recording: $(cat "$work/simulate")"
  first=$("$check" prepare "$recording" "$work/video.avi" "$work/camera.yaml") || fail "no video of the recording"
  printf 'version = 1\n[replay]\nrecording = "%s"\n[dds]\ndomain = %d\n' "$recording" $domain > "$work/perimapd.toml"
  rm -f "$work/received.mcap"
  "$build/daemon/perimap" watch --domain $domain --wait 60 --record "$work/received.mcap" > "$work/watch" 2>&1 &
  watch=$!
  "$work/build/overlay" "$work/video.avi" "$work/camera.yaml" "$work/overlay.png" --domain $domain --first-sequence "$first" \
    > "$work/lines" 2> "$work/error" &
  overlay=$!
  sleep 1
  "$build/daemon/perimapd" -c "$work/perimapd.toml" 2> "$work/log" || fail "perimapd: $(cat "$work/log")"
  sleep 0.5
  kill -INT $watch
  wait $watch || fail "watch: $(tail -n 5 "$work/watch")"
  wait $overlay || fail "the example ended with $?: $(cat "$work/error")"
  "$check" judge "$recording" "$work/received.mcap" "$work/lines" "$work/overlay.png" || fail "see above"
}
drawn exact --duration 10
# An angled scope that is turned meanwhile: the lens is each surface's own, and nothing is drawn while its turn is not known.
drawn turned --duration 12 --field-stop 40 --turn-to 95 --turn-at 6
grep -q 'it is not known where the camera was' "$work/lines" || fail "it drew while the scope was being turned"
"$work/build/overlay" none.avi "$work/camera.yaml" "$work/none.png" 2> "$work/error" && fail "a video that is not there is taken"
grep -q 'none.avi: cannot be read' "$work/error" || fail "$(cat "$work/error")"
echo "as promised"
