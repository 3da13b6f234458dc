# For the guest's scripts: the installed package, devices, what a subscriber receives.
. /vm/until_true.sh
cd /tmp || exit 1
mkdir -m 755 /run/emulated

fail() {
  echo "FAILED: $1"
  perimap probe /etc/perimap/perimapd.toml
  journalctl -u perimapd --no-pager -o cat -n 40
  exit 1
}

# What the package holds, in its place. dpkg's own installation takes minutes in here, most of them for reading about a
# thousand other packages.
unpacked() {
  dpkg-deb -x /vm/package/*.deb / && systemd-sysusers /usr/lib/sysusers.d/perimap.conf && systemctl daemon-reload ||
    fail "the package can not be unpacked"
  service_ready
}

installed() {
  dpkg --force-unsafe-io -i /vm/package/*.deb > /tmp/dpkg 2>&1 || fail "installation: $(cat /tmp/dpkg)"
  service_ready
}

service_ready() {
  export CYCLONEDDS_URI=file:///etc/perimap/cyclonedds-loopback.xml
  # Its AppArmor profile, with what an administrator would add for devices like the emulated ones.
  aa-enabled --quiet || fail "this kernel has no AppArmor"
  mkdir -p /etc/apparmor.d/local
  echo '/dev/pts/[0-9]* rwk,' > /etc/apparmor.d/local/perimapd
  apparmor_parser --replace --skip-cache /etc/apparmor.d/perimapd || fail "the profile can not be loaded"
}

# It runs under its profile, and nothing that it has tried so far was denied.
confined() {
  local label
  label=$(cat "/proc/$(systemctl show -P MainPID perimapd)/attr/apparmor/current")
  [ "$label" = "perimapd (enforce)" ] || fail "it is confined by '$label'"
  dmesg | grep 'apparmor="DENIED".*profile="perimapd"' && fail "its profile denies what it needs"
  echo "ok: it runs under its AppArmor profile, which has denied nothing"
}

# vcan0 and /dev/video0, a camera without a heart before it: vivid draws a moving pattern.
device_nodes() {
  ip link set lo up
  modprobe vcan && ip link add vcan0 type vcan && ip link set vcan0 up || fail "no vcan"
  modprobe vivid n_devs=1 node_types=0x1 || fail "no vivid"
  udevadm settle
  [ -e /dev/video0 ] || fail "no /dev/video0"
  # At first it stamps a frame with the end that its exposure would have, which is still to come when it hands it over.
  v4l2-ctl -d /dev/video0 --set-ctrl timestamp_source=1 || fail "vivid does not take another source of stamps"
}

# Tracker and ECG of a simulated heart. The pseudo-terminal belongs to the service's group, as udev would have it.
devices_emulated() {
  perimap emulate ndi=/run/emulated/tracker can-ecg=can:vcan0 \
    --can-identifier 0x18FF02E0 --can-extended --can-rate 500 --can-count 0.01 "$@" > /tmp/emulators 2>&1 &
  emulators=$!
  for _ in $(seq 300); do
    [ ! -e /run/emulated/tracker ] || break
    sleep 0.1
  done
  chgrp perimap "$(readlink -f /run/emulated/tracker)" && chmod 660 "$(readlink -f /run/emulated/tracker)" ||
    fail "no emulated tracker: $(cat /tmp/emulators)"
}

configured() {
  cp /vm/camera.yaml /etc/perimap/camera.yaml
  cat > /etc/perimap/perimapd.toml << 'END'
version = 1
[camera]
device = "v4l2:/dev/video0"
calibration = "camera.yaml"
frame_rate_hz = 15
[tracker]
protocol = "ndi"
port = "/run/emulated/tracker"
[ecg]
protocol = "can"
port = "can:vcan0"
can_identifier = 0x18FF02E0
can_extended = true
can_sample_rate_hz = 500
count_mV = 0.01
[recording]
folder = "/var/lib/perimap"
END
  chgrp perimap /etc/perimap/perimapd.toml /etc/perimap/camera.yaml
  perimap check /etc/perimap/perimapd.toml > /dev/null || fail "the configuration is refused"
}

# The unpacked package's service, with all devices there.
service_over_devices() {
  uname -rv
  device_nodes
  unpacked
  devices_emulated
  configured
  perimap probe /etc/perimap/perimapd.toml || fail "a device is not there"
  systemctl restart perimapd || fail "the service does not start"
  systemctl is-active perimapd || fail "the service is not active"
}

all_stopped() {
  systemctl stop perimapd || fail "the service does not stop"
  kill -INT $emulators
  wait $emulators || fail "the emulators: $(cat /tmp/emulators)"
}

# received SECONDS FILE: what a subscriber sees, a JSON object a line
received() {
  timeout 120 perimap watch --json --wait 60 --duration "$1" > "$2" || fail "nothing was received: $(tail -n 1 "$2")"
}

# holds FILE DESCRIPTION EXPRESSION: of the last line, as `x`, in JavaScript
holds() {
  if node -e '
    const x = JSON.parse(require("fs").readFileSync(process.argv[1], "utf8").trim().split("\n").pop());
    process.exit(eval(process.argv[2]) ? 0 : 1)' "$1" "$3"; then
    echo "ok: $2"
  else
    fail "$2: $3 does not hold of $(tail -n 1 "$1")"
  fi
}
