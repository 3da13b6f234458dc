# An R trigger's line, for the guest's scripts: a USB serial gadget at a bus of the kernel's own. While its end is open,
# the other end, /dev/ttyACM0, sees carrier.

. /vm/until_true.sh

# trigger_line ON_S OFF_S: pulses so long, with such pauses; $beats is the process that makes them. The USB device is
# $trigger_usb: while its `authorized` there is 0 the kernel has taken the port away, as when its plug is pulled. (The
# gadget's own `soft_connect` does not bring it back on this bus.)
trigger_line() {
  modprobe dummy_hcd && modprobe g_serial || fail "no serial gadget"
  # The bus takes its time to find the gadget, and nothing says when it has.
  until_true 30 test -e /dev/ttyACM0 || fail "the serial gadget is not found"
  udevadm settle
  [ -e /dev/ttyACM0 ] && [ -e /dev/ttyGS0 ] || fail "no serial port of it"
  trigger_usb=$(dirname "$(realpath /sys/class/tty/ttyACM0/device)")
  (
    while :; do
      exec 3<> /dev/ttyGS0
      sleep "$1"
      exec 3>&-
      sleep "$2"
    done
  ) &
  beats=$!
}
