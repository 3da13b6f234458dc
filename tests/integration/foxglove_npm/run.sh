#!/bin/bash
# run.sh SOURCE_FOLDER WORK_FOLDER PERIMAP PUBLISHER CYCLONEDDS_XML: `perimap bridge foxglove` between a scripted perimapd
# and the official client of its protocol, which judges what it receives.
# Exit code 77: skipped, with the reason on standard output.
set -euo pipefail
source_folder=$1 work_folder=$2 perimap=$3 publisher=$4 xml=$5
. "$(dirname "$0")/../npm_packages.sh"
npm_packages "$source_folder" "$work_folder" check_bridge.mjs
cd "$work_folder"
# Test runs on one host do not hear each other.
tag=foxglove-$$
domain=$((20 + $$ % 100))
export CYCLONEDDS_URI="file://$xml,<CycloneDDS><Domain><Discovery><Tag>$tag</Tag></Discovery></Domain></CycloneDDS>"

cleanup() { kill "$bridge" "$published" "$judge" 2> /dev/null || true; }
bridge= published= judge=
rm -f address said subscribed
trap cleanup EXIT
"$perimap" bridge foxglove --domain $domain --port 0 > address 2> said &
bridge=$!
for _ in $(seq 300); do
  if [ -s address ]; then break; fi
  sleep 0.1
done
address=$(cat address)
case $address in
  ws://127.0.0.1:*) ;;
  *)
    echo "the bridge printed '$address'" >&2
    cat said >&2
    exit 1
    ;;
esac
# The client is there before anything is published: a program that starts slowly would miss what comes first.
node check_bridge.mjs "$address" subscribed &
judge=$!
until [ -e subscribed ] || ! kill -0 $judge 2> /dev/null; do sleep 0.1; done
"$publisher" $domain &
published=$!
for _ in $(seq 1200); do
  if grep -q "nothing has come from perimapd" said || ! kill -0 $judge 2> /dev/null; then break; fi
  sleep 0.1
done
# An end of its own, when it is asked to: its viewers hear a last word.
kill -INT $bridge
wait $judge
wait $bridge
