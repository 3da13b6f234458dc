#!/bin/bash
# Other processes, of whatever user, have every participant index of the domain: who comes then joins all the same, and is
# heard by those that have one.
#   no_index_is_needed.sh FOLDER_OF_THE_PROGRAMS
set -u
programs=$1
. "$(dirname "$0")/isolated_domain.sh"
# Fewer than in deploy/, so that few processes have them all.
few='<CycloneDDS><Domain><Discovery><MaxAutoParticipantIndex>3</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>'
export CYCLONEDDS_URI="$CYCLONEDDS_URI,$few"
scratch=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null; rm -rf "$scratch"' EXIT

for i in 0 1 2 3; do
  "$programs/domain_member" "$DOMAIN" - listen 12 > "$scratch/$i.out" 2> "$scratch/$i.err" &
done
sleep 2
"$programs/domain_member" "$DOMAIN" - publish late 8 > "$scratch/late.out" 2> "$scratch/late.err" || {
  echo "FAILED: the fifth did not join: $(cat "$scratch/late.err")"
  exit 1
}
grep -q 'free participant index' "$scratch/late.err" || {
  echo "FAILED: there was an index left, so that this tries nothing: $(cat "$scratch/late.err")"
  exit 1
}
wait
with_index=0
for i in 0 1 2 3; do
  # Another process on this host may have had one of them.
  grep -q 'free participant index' "$scratch/$i.err" && continue
  with_index=$((with_index + 1))
  grep -qE '^late [0-9]{2,}$' "$scratch/$i.out" || {
    echo "FAILED: listener $i heard: $(cat "$scratch/$i.out" "$scratch/$i.err")"
    exit 1
  }
done
[ $with_index -gt 0 ] || {
  echo "FAILED: no listener had an index"
  exit 1
}
