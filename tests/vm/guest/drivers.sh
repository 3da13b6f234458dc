# The kernel's own drivers at the far end: an R trigger on a serial port's modem line, and a recording's frames out of a
# video output and in by a camera.
set -uo pipefail
cd /tmp || exit 1
uname -rv
PATH=/vm/bin:$PATH

fail() {
  echo "FAILED: $1"
  exit 1
}

. /vm/trigger.sh
trigger_line 0.1 0.7
printf 'version = 1\n[ecg]\nr_trigger = true\nr_trigger_port = "/dev/ttyACM0"\n' > trigger.toml
perimap probe trigger.toml --seconds 12 --json > trigger.json || fail "the trigger is not there: $(cat trigger.json)"
kill $beats
# The processor is slow: how many are seen does not matter, only that they are pulses.
node -e '
  const x = JSON.parse(require("fs").readFileSync("trigger.json")).r_trigger;
  console.log(`${x.samples} pulses, ${x.lost} lost, ${x.damaged} damaged`);
  process.exit(x.state === "streaming" && x.samples >= 3 && x.damaged === 0 ? 0 : 1)' ||
  fail "the trigger: $(cat trigger.json)"
echo "ok: R peaks from carrier detect"

# vivid joins its output to its input where both have the same format, and no text is drawn over it.
modprobe vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=0x3 num_outputs=1 output_types=0x1 || fail "no vivid"
udevadm settle
for node in 0 1; do v4l2-ctl -d /dev/video$node --set-dv-bt-timings index=0 > /dev/null || fail "no timings"; done
v4l2-ctl -d /dev/video0 --set-ctrl timestamp_source=1,loop_video=1,osd_text_mode=2 || fail "vivid does not loop"
printf 'version = 1\n[camera]\ndevice = "v4l2:/dev/video0"\nformat = "mono8"\n' > camera.toml
perimap record -c camera.toml /vm/seen.mcap --seconds 30 > record 2>&1 &
record=$!
perimap emulate camera=v4l2:/dev/video1 --recording /vm/played.mcap > emulated 2>&1 &
emulator=$!
wait $record || fail "no recording: $(cat record)"
kill -INT $emulator
wait $emulator || fail "the emulator: $(cat emulated)"
cat emulated
same=$(/vm/bin/same_frames /vm/played.mcap /vm/seen.mcap) || fail "what came cannot be read"
echo "frames of the recording among those that came: $same"
[ "${same%% *}" -ge 20 ] || fail "the frames did not come through"
echo "ok: own frames out of a video output and in by a camera"
