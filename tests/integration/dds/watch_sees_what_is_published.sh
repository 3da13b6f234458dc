#!/bin/bash
# `perimap watch` as a process of its own: counts, JSON, recording, exit codes.
#   watch_sees_what_is_published.sh PERIMAP FOLDER_OF_THE_PROGRAMS
set -u
perimap=$1
programs=$2
. "$(dirname "$0")/isolated_domain.sh"
scratch=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null; rm -rf "$scratch"' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}

"$perimap" watch --domain "$DOMAIN" --wait 0.3 2>"$scratch/nobody" && fail "a watch without a publisher ended with 0"
grep -q "no surface was received in DDS domain $DOMAIN" "$scratch/nobody" || fail "no word about the missing publisher"
"$perimap" watch --domain 300 2>/dev/null
[ $? -eq 2 ] || fail "a domain that does not exist must end with 2"
"$perimap" watch --domain "$DOMAIN" --wait 0.1 --record /nowhere/x.mcap 2>"$scratch/unwritable"
[ $? -eq 1 ] || fail "a recording that cannot be written must end with 1"
grep -q "/nowhere/x.mcap" "$scratch/unwritable" || fail "the error does not name the recording"

"$perimap" watch --domain "$DOMAIN" --wait 0.1 --session "$scratch/x.html" 2>"$scratch/unrecorded"
[ $? -eq 2 ] || fail "a page of what is not recorded must end with 2"
"$perimap" watch --domain "$DOMAIN" --wait 0.1 --record "$scratch/x.mcap" --session /nowhere/x.html 2>"$scratch/unwritable"
[ $? -eq 1 ] || fail "a page that cannot be written must end with 1"
grep -q "/nowhere/x.html" "$scratch/unwritable" || fail "the error does not name the page"
[ ! -e "$scratch/x.mcap" ] || fail "it recorded before it said so"
"$perimap" watch --domain "$DOMAIN" --wait 60 --json --count 120 --record "$scratch/x.mcap" --session "$scratch/x.html" \
  >"$scratch/counted" &
counted=$!
"$perimap" watch --domain "$DOMAIN" --wait 60 --json --once >"$scratch/once" &
once=$!
"$perimap" watch --domain "$DOMAIN" >"$scratch/stopped" &
stopped=$!
"$programs/synthetic_publisher" "$DOMAIN" 3 150 60 50 || fail "the publisher"
wait "$counted" || fail "watch --count ended with $?"
wait "$once" || fail "watch --once ended with $?"
kill -INT "$stopped"
wait "$stopped" || fail "watch ended with $? on SIGINT"

grep -q '^{"kind":"interval","source":"synthetic","stream":"frame"' "$scratch/counted" || fail "no line a second"
tail -n 1 "$scratch/counted" | grep -q '^{"kind":"summary".*"received":120,"missing":0,' || fail "summary: $(tail -n 1 "$scratch/counted")"
[ "$(wc -l <"$scratch/once")" -eq 1 ] || fail "watch --once printed more than one line"
grep -q '^{"kind":"surface".*"sample_sequence":0,.*"id":49,' "$scratch/once" || fail "watch --once: $(cut -c 1-300 "$scratch/once")"
grep -q '150 surfaces in .* 0 lost' "$scratch/stopped" || fail "summary after SIGINT: $(cat "$scratch/stopped")"
[ -s "$scratch/x.mcap" ] || fail "no recording"
grep -q '</html>' "$scratch/x.html" || fail "no page of the session"
[ "$(tail -c 8 "$scratch/x.mcap" | od -An -tx1 | tr -d ' ')" = 894d434150300d0a ] || fail "the recording is not whole"
