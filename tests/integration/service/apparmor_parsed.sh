#!/bin/bash
# AppArmor's own parser takes the profile, also with an administrator's additions, and refuses one that is garbled.
# apparmor_parsed.sh PROFILE
set -uo pipefail
profile=$1
parser=$(PATH=$PATH:/usr/sbin:/sbin command -v apparmor_parser) ||
  { echo "apparmor_parser is not there: deploy/install-packages.sh --full"; exit 77; }
[ -e /etc/apparmor.d/tunables/global ] || { echo "AppArmor's abstractions are not there"; exit 77; }

fail() {
  echo "FAILED: $1"
  exit 1
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Nothing is loaded into the kernel, nothing cached.
parsed() { "$parser" --skip-kernel-load --skip-cache --skip-read-cache "$@" > "$work/told" 2>&1; }

parsed "$profile" || fail "it is refused: $(cat "$work/told")"
grep -i 'error\|not supported' "$work/told" && fail "it is not taken as it stands"
[ "$("$parser" --names "$profile" 2> /dev/null)" = perimapd ] || fail "it is not the profile perimapd alone"

mkdir "$work/local"
echo '/srv/calibrations/** r,' > "$work/local/perimapd"
parsed --Include "$work" "$profile" || fail "with additions it is refused: $(cat "$work/told")"
echo 'not a rule' > "$work/local/perimapd"
parsed --Include "$work" "$profile" && fail "local/perimapd is not read"

sed 's/ network can raw,/ network can raw/' "$profile" > "$work/garbled"
parsed "$work/garbled" && fail "a garbled one is taken"
echo "as promised"
