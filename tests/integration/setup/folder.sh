# A folder of a test's own ($work), whose recordings go with it, and $perimap, which must succeed; sourced.
. "$(dirname "${BASH_SOURCE[0]}")/../figures.sh"
rm -rf "$work"
mkdir -p "$work"
cd "$work"
trap 'rm -f "$work"/*.mcap' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}
quiet() { "$perimap" "$@" > out 2> errors || fail "perimap $*: $(cat out errors)"; }
