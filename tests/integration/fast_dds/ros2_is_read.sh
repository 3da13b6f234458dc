#!/bin/bash
# ros2_is_read.sh PERIMAP PUBLISHER READER DEPLOY: perimap bridge ros2 between a scripted perimapd and a reader of another
# vendor, Fast DDS.
set -euo pipefail
perimap=$1 publisher=$2 reader=$3
PERIMAP_DEPLOY=$4
. "$(dirname "$0")/../dds/isolated_domain.sh"
# Fast DDS does not know Cyclone's tag: the ROS domain has none, and a number that others hardly have.
work=$(mktemp -d)
bridge= published=
cleanup() {
  kill "$bridge" "$published" 2> /dev/null || true
  rm -rf "$work"
}
trap cleanup EXIT
ros_domain=$((120 + $$ % 100))
tag_of_perimap=${CYCLONEDDS_URI##*<Tag>}
tag_of_perimap=${tag_of_perimap%%</Tag>*}
export CYCLONEDDS_URI="file://$PERIMAP_DEPLOY/cyclonedds-loopback.xml,<CycloneDDS><Domain Id=\"$DOMAIN\"><Discovery><Tag>$tag_of_perimap</Tag></Discovery></Domain></CycloneDDS>"
"$perimap" bridge ros2 --domain "$DOMAIN" --ros-domain $ros_domain > "$work/topics" 2> "$work/said" &
bridge=$!
"$publisher" "$DOMAIN" &
published=$!
if ! "$reader" $ros_domain 60; then
  cat "$work/topics" "$work/said" >&2
  exit 1
fi
kill -INT $bridge
wait $bridge
