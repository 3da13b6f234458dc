# perimapd as an installed service, ECG over CAN, frames from a V4L2 node, the tracker over a pseudo-terminal: what does
# a DDS subscriber receive, with all of them and while each is gone?
set -uo pipefail
. /vm/common.sh
service_over_devices

received 15 /tmp/all
holds /tmp/all "a sample a frame, none lost" "x.received > 20 && x.missing === 0"
holds /tmp/all "the heart rate is that of the ECG over CAN" "x.cardiac_rate_per_min > 60 && x.cardiac_rate_per_min < 100"
holds /tmp/all "frames have a pose" "x.status.frames_without_pose < x.status.frames / 2"

ip link set vcan0 down
received 8 /tmp/no_ecg
holds /tmp/no_ecg "without an ECG it publishes on and says so" "x.received > 10 && x.reason === 'phase_lost'"
ip link set vcan0 up
received 15 /tmp/ecg_again
holds /tmp/ecg_again "the ECG is back" "x.reason !== 'phase_lost'"
all_stopped
