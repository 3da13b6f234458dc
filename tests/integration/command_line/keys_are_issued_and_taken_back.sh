#!/bin/bash
# `perimap keys` from an authority to keys that are revoked, and what perimap and perimapd say of such keys.
#   keys_are_issued_and_taken_back.sh PERIMAP PERIMAPD
set -uo pipefail
perimap=$1
perimapd=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
keys=$work/keys
failed=0

run() { # CODE WORDS COMMAND...: ends with the code and says the words
  local code=$1 words=$2
  shift 2
  timeout 60 "$@" > "$work/out" 2>&1
  local got=$?
  if [ $got -ne "$code" ] || ! grep -qE "$words" "$work/out"; then
    echo "FAILED: $* ended with $got, expected $code and '$words': $(cat "$work/out")"
    failed=1
  fi
}

run 1 'authority.s private key \(perimap keys init makes one\)' "$perimap" keys show --directory "$keys"
run 0 'an authority until' "$perimap" keys init --directory "$keys"
run 1 'there is an authority already' "$perimap" keys init --directory "$keys"
run 0 "keys of 'theatre' as publisher until" "$perimap" keys issue publisher theatre --directory "$keys"
run 0 "keys of 'navigation' as display until" "$perimap" keys issue display navigation --directory "$keys"
run 0 "keys of 'brief' as recorder until" "$perimap" keys issue recorder brief --directory "$keys" --days 20
run 1 'is there already \(--renew' "$perimap" keys issue display navigation --directory "$keys"
run 2 'ROLE' "$perimap" keys issue surgeon x --directory "$keys"
run 1 'expected a name' "$perimap" keys issue display ../x --directory "$keys"
run 0 "keys of 'theatre' as publisher, in order until" "$perimap" keys check "$keys/theatre"
run 1 "keys of 'brief' \(recorder\) end .* in (19|20) days" "$perimap" keys check "$keys/brief"
run 0 'brief .*recorder .*ENDS IN (19|20) DAYS' "$perimap" keys show --directory "$keys"
run 0 "'navigation': 1 certificate is revoked" "$perimap" keys revoke navigation --directory "$keys"
run 0 'is revoked already' "$perimap" keys revoke navigation --directory "$keys"
run 1 'certificate.pem: is revoked' "$perimap" keys check "$keys/navigation"
run 0 'navigation .*REVOKED' "$perimap" keys show --directory "$keys"
run 2 'certificate.pem: is revoked' "$perimap" watch --security "$keys/navigation" --wait 0.1
run 0 "keys of 'navigation' as display until" "$perimap" keys issue display navigation --directory "$keys" --renew
run 0 'in order until' "$perimap" keys check "$keys/navigation"
run 1 'no surface was received' "$perimap" watch --security "$keys/navigation" --wait 0.5 --domain 116

# What perimapd and perimap check say of the line in the configuration.
configuration() { # KEYS
  printf 'version = 1\n[dds]\nsecurity = "%s"\n[replay]\nrecording = "%s"\n' "$1" "$work/none.mcap" > "$work/perimapd.toml"
  touch "$work/none.mcap"
}
configuration "$keys/theatre"
run 0 'security = ' "$perimap" check "$work/perimapd.toml"
configuration "$keys/navigation"
run 2 "key 'dds.security': expected keys of a publisher, got those of a display" "$perimap" check "$work/perimapd.toml"
configuration "$keys/nowhere"
run 2 "key 'dds.security': expected the name of an existing folder" "$perimap" check "$work/perimapd.toml"
run 2 "key 'dds.security': expected the name of an existing folder" "$perimapd" -c "$work/perimapd.toml"

# Recordings and checkpoints that are too old.
printf '\211MCAP0\r\nx' > "$work/old.mcap"
printf 'PERIMAPCx' > "$work/checkpoint"
printf '\211MCAP0\r\nx' > "$work/new.mcap"
touch -d '40 days ago' "$work/old.mcap" "$work/checkpoint" "$work/perimapd.toml"
run 0 'would remove .*old.mcap' "$perimap" forget --older-than 30d --dry-run "$work"
[ -e "$work/old.mcap" ] || { echo 'FAILED: --dry-run removed a recording'; failed=1; }
run 0 '2 files' "$perimap" forget --older-than 30d "$work"
for gone in old.mcap checkpoint; do
  [ ! -e "$work/$gone" ] || { echo "FAILED: $gone is still there"; failed=1; }
done
for kept in new.mcap perimapd.toml; do
  [ -e "$work/$kept" ] || { echo "FAILED: $kept is gone"; failed=1; }
done
run 2 'expected a number of hours, days or weeks' "$perimap" forget --older-than soon "$work"
run 1 'cannot be read' "$perimap" forget --older-than 1d "$work/nowhere"
exit $failed
