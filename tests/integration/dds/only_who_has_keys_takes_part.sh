#!/bin/bash
# A secured domain on real participants, each a process of its own: who has keys of the authority hears and is heard as
# its role says; a stranger, a display that publishes, and those with an expired, a revoked or a foreign certificate are
# neither heard nor hear anything, and each is told.
#   only_who_has_keys_takes_part.sh FOLDER_OF_THE_PROGRAMS
set -u
programs=$1
. "$(dirname "$0")/isolated_domain.sh"
scratch=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null; rm -rf "$scratch"' EXIT

failed=0
fail() {
  echo "FAILED: $1"
  failed=1
}
keys() { "$programs/key_maker" "$@" || fail "key_maker $*"; }
member() { # NAME KEYS MODE...: in the background, its output in $scratch/NAME.out and .err, its code in .code
  local name=$1
  shift
  (
    "$programs/domain_member" "$DOMAIN" "$@" > "$scratch/$name.out" 2> "$scratch/$name.err"
    echo $? > "$scratch/$name.code"
  ) &
}
heard() { awk -v source="$2" '$1 == source { print $2; found = 1 } END { if (!found) print 0 }' "$scratch/$1.out"; }
expect_heard() { # LISTENER SOURCE
  [ "$(heard "$1" "$2")" -gt 30 ] || fail "$1 heard $(heard "$1" "$2") of $2: $(cat "$scratch/$1.err")"
}
expect_silence() { # LISTENER SOURCE
  [ "$(heard "$1" "$2")" -eq 0 ] || fail "$1 heard $(heard "$1" "$2") samples of $2"
}
expect_refused() { # NAME
  [ "$(cat "$scratch/$1.code")" -eq 3 ] || fail "$1 ended with $(cat "$scratch/$1.code"): $(cat "$scratch/$1.err")"
  [ -s "$scratch/$1.err" ] || fail "$1 was not told why"
}
expect_told() { # FOLDER WORDS: by the check that perimap's programs make before they join
  "$programs/key_maker" "$1" check 2> "$scratch/told" && fail "the keys of $1 are said to be in order"
  grep -q "$2" "$scratch/told" || fail "$1: expected '$2', got: $(cat "$scratch/told")"
}

ours=$scratch/ours
keys "$ours" init
keys "$ours" issue publisher perimapd 86400
keys "$ours" issue display display 86400
keys "$ours" issue control-loop loop 86400
keys "$ours" issue recorder recorder 86400
keys "$ours" issue bridge bridge 86400
keys "$ours" issue publisher lost 86400
keys "$ours" issue display lost-display 86400
keys "$ours" issue publisher late 6
keys "$ours" issue display late-display 6
keys "$scratch/foreign" init
keys "$scratch/foreign" issue publisher foreign 86400
keys "$scratch/foreign" issue display foreign-display 86400
# What the lost ones have on their machines is as it was: nobody brings them the list.
cp -r "$ours/lost" "$scratch/lost"
cp -r "$ours/lost-display" "$scratch/lost-display"
keys "$ours" revoke lost
keys "$ours" revoke lost-display

# Those whose keys end join while they hold, and try when they have ended.
member late-publisher "$ours/late" publish late 18 8
member late-listener "$ours/late-display" listen 18 8
sleep 7
expect_told "$ours/late" 'has expired'
expect_told "$ours/lost" 'is revoked'

for role in display loop recorder bridge; do member "$role" "$ours/$role" listen 14; done
member stranger-listener - listen 14
member lost-listener "$scratch/lost-display" listen 14
member foreign-listener "$scratch/foreign/foreign-display" listen 14
sleep 1
member perimapd "$ours/perimapd" publish true 11
member stranger - publish stranger 11
member display-that-publishes "$ours/display" publish display 11
member lost-publisher "$scratch/lost" publish lost 11
member foreign-publisher "$scratch/foreign/foreign" publish foreign 11
member expired-publisher "$ours/late" publish expired 11
wait

for listener in display loop recorder bridge; do
  expect_heard "$listener" true
  for source in stranger display lost foreign late expired; do expect_silence "$listener" "$source"; done
done
for listener in lost-listener late-listener; do
  expect_silence "$listener" true
done
# These are in a world of their own: what they hear is each other.
expect_silence stranger-listener true
expect_heard stranger-listener stranger
expect_silence foreign-listener true
expect_heard foreign-listener foreign
expect_refused display-that-publishes
expect_refused expired-publisher
# Cyclone's own word to who was there, whom nobody has warned: whose certificate it was that was refused.
for listener in display recorder; do
  grep -q 'certificate revoked; subject: .*CN=lost' "$scratch/$listener.err" || fail "$listener was not told of the revoked one"
  grep -q 'unable to get local issuer.*CN=foreign' "$scratch/$listener.err" || fail "$listener was not told of the foreign one"
done
for name in late-publisher late-listener lost-publisher lost-listener foreign-publisher stranger; do
  [ "$(cat "$scratch/$name.code")" -eq 0 ] || fail "$name ended with $(cat "$scratch/$name.code"): $(tail -n 3 "$scratch/$name.err")"
done
[ $failed -eq 0 ] || { for f in "$scratch"/*.err; do echo "== $f"; head -n 5 "$f"; done; }
exit $failed
