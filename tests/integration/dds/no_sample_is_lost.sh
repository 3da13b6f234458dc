#!/bin/bash
# One publisher and two subscribers as separate processes: 200 features at 60 Hz, and no sequence number may be missing
# at either subscriber.
#   no_sample_is_lost.sh FOLDER_OF_THE_PROGRAMS SECONDS
set -u
programs=$1
samples=$((60 * $2))
. "$(dirname "$0")/isolated_domain.sh"

"$programs/cpp_subscriber" "$DOMAIN" "$samples" &
cpp=$!
"$programs/c_subscriber" "$DOMAIN" "$samples" &
c=$!
trap 'kill $cpp $c 2>/dev/null' EXIT
"$programs/synthetic_publisher" "$DOMAIN" 2 "$samples" 60 200 || exit 1
failed=0
wait "$cpp" || failed=1
wait "$c" || failed=1
exit "$failed"
