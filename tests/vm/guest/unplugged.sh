# perimapd as an installed service: the CAN interface goes down, the camera is taken from its driver, the R trigger's USB
# port is taken away, 20 times each. Each time a subscriber is told and the device recovers; nothing leaks.
set -uo pipefail
. /vm/common.sh
. /vm/trigger.sh
service_over_devices

received 15 /tmp/all
holds /tmp/all "a sample a frame, none lost" "x.received > 20 && x.missing === 0"
daemon=$(systemctl show -P MainPID perimapd)

pulled() { # SOURCE PULL PLUG
  local told
  told=$(/vm/bin/pulled_device "$daemon" "$1" 20 "$2" "$3" 2>&1) || fail "$1: $told"
  echo "ok: $1: $told"
}
pulled ecg "ip link set vcan0 down" "ip link set vcan0 up"
driver=/sys/bus/platform/drivers/vivid
pulled camera "echo vivid.0 > $driver/unbind" \
  "echo vivid.0 > $driver/bind && udevadm settle && v4l2-ctl -d /dev/video0 --set-ctrl timestamp_source=1"

received 15 /tmp/again
holds /tmp/again "afterwards a sample a frame, none lost" "x.received > 20 && x.missing === 0"
[ "$(systemctl show -P MainPID perimapd)" = "$daemon" ] || fail "it was started again"

# R peaks from a trigger, and the ECG beside it.
trigger_line 0.3 0.5
sed -i '/^\[ecg\]/a r_trigger = true\nr_trigger_port = "/dev/ttyACM0"' /etc/perimap/perimapd.toml
systemctl restart perimapd || fail "the service does not start with a trigger"
daemon=$(systemctl show -P MainPID perimapd)
received 5 /tmp/trigger
pulled r_trigger "echo 0 > $trigger_usb/authorized" "echo 1 > $trigger_usb/authorized"
[ "$(systemctl show -P MainPID perimapd)" = "$daemon" ] || fail "it was started again with a trigger"
kill $beats
all_stopped
