#!/bin/bash
# calibrate tracker --moved: what is wrong with it is told before anything is measured at rest, and what only means
# something with it is refused without.
# moved_is_checked_first.sh PERIMAP WORK_FOLDER
set -euo pipefail
perimap=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
cd "$work"

fail() {
  echo "FAILED: $1"
  exit 1
}
refused() { # CODE ARGUMENTS
  local code=$1 ended=0
  shift
  "$perimap" calibrate tracker "$@" > out 2> errors || ended=$?
  [ $ended -eq "$code" ] || fail "calibrate tracker $* ended with $ended: $(cat out errors)"
}
printf '%%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 700., 0., 320., 0., 700., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n' > camera.yaml
# Poses that are none: whoever looked at them first would say so.
echo nothing > poses.csv
refused 1 poses.csv --moved gone.mcap --square-mm 8 --calibration camera.yaml
grep -q 'gone.mcap' errors || fail "the recording that is not there is not told first: $(cat errors)"
for without in '--square-mm 8' '--calibration camera.yaml' '--board-tool instrument/board' '--board charuco' '--size 9x6'; do
  # shellcheck disable=SC2086
  refused 2 poses.csv $without
  grep -q -e '--moved' errors || fail "$without alone: $(cat errors)"
done
refused 1 poses.csv
grep -q 'poses.csv' errors || fail "the poses are not told: $(cat errors)"
echo passed
