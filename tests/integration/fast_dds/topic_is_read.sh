#!/bin/bash
# topic_is_read.sh PUBLISHER READER DEPLOY: a reader of another vendor, Fast DDS, takes a topic as perimapd publishes it.
set -euo pipefail
publisher=$1 reader=$2 deploy=$3
# Fast DDS does not know Cyclone's tag, by which other tests are kept apart: a domain that others hardly have.
domain=$((120 + $$ % 100))
export CYCLONEDDS_URI="file://$deploy/cyclonedds-loopback.xml"
"$publisher" $domain &
published=$!
trap 'kill $published 2> /dev/null || true' EXIT
"$reader" $domain 60
