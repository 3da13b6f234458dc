# What tests of perimapd over emulated devices begin with; sourced. $work is emptied. They speak DDS on $domain; the
# emulated tracker listens on $port, the ECG's pseudo-terminal is $line. What is in `started` ends with the test.
domain=$((40 + $$ % 150))
port=$((20000 + $$ % 20000))
rm -rf "$work"
mkdir -p "$work"
# Names of links and sockets must be short, and the work folder may lie deep.
short=$(mktemp -d "${TMPDIR:-/tmp}/perimap-devices-XXXXXX")
line=$short/ecg
started=()
trap 'kill -9 "${started[@]}" 2> /dev/null; rm -rf "$short"' EXIT

# ended PID: it was waited for; its number may be another's by now
ended() {
  local pid left=()
  for pid in "${started[@]}"; do [ "$pid" = "$1" ] || left+=("$pid"); done
  started=("${left[@]}")
}

fail() {
  echo "FAILED: $1"
  exit 1
}

# emulate RECORDING OPTION...: a tracker and an ECG that play the recording from $start on, soon; $emulators is theirs
emulate() {
  local recording=$1
  shift
  # Both ends must be ready before the recording begins, on a machine that is busy with other things as well.
  start=$(awk '{printf "%.3f", $1 + 8}' /proc/uptime)
  "$perimap" emulate ndi=tcp:127.0.0.1:$port cyton="$line" --recording "$recording" --start "$start" "$@" \
    > "$work/emulators" 2>&1 &
  emulators=$!
  started+=($emulators)
}

# lens_yaml WIDTH HEIGHT: the calibration of a lens that nobody knows, for a camera that keeps still, where it does not
# matter
lens_yaml() {
  cat << END
%YAML:1.0
---
image_width: $1
image_height: $2
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ $1, 0., $(($1 / 2)), 0., $1, $(($2 / 2)), 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
END
}

# ecg_and_dds_toml: what the configurations below end with
ecg_and_dds_toml() {
  cat << END
[ecg]
protocol = "cyton"
port = "$line"
[dds]
domain = $domain
END
}

# still_toml VIDEO CALIBRATION: a configuration with a video for a camera, before a tracker that keeps still (tool 0B)
still_toml() {
  cat << END
version = 1
[camera]
device = "video:$(realpath "$1")"
calibration = "$2"
[tracker]
protocol = "ndi"
port = "tcp:127.0.0.1:$port"
sensor = "0B"
END
  ecg_and_dds_toml
}

# devices_toml RECORDING: a configuration for them, with the recording's frames for a camera
devices_toml() {
  cat << END
version = 1
[camera]
playback = "$1"
playback_start_s = $start
[tracker]
protocol = "ndi"
port = "tcp:127.0.0.1:$port"
frame_rate_hz = 100
END
  ecg_and_dds_toml
}
