# What tests of commands ask of the figures that these write; sourced. fail() must be there.

# number FILE KEY: the first number of a key in JSON.
number() { tr -d ' \n' < "$1" | grep -o "\"$2\":\[*-*[0-9.e+-]*" | head -1 | sed 's/.*[:[]//'; }
# nth FILE KEY N: the Nth number of a key's first list.
nth() { tr -d ' \n' < "$1" | grep -o "\"$2\":\[[^]]*" | head -1 | cut -d'[' -f2 | cut -d, -f"$3"; }
# near WHAT VALUE TRUTH TOLERANCE
near() {
  awk -v v="$2" -v t="$3" -v e="$4" 'BEGIN { d = v - t; if (d < 0) d = -d; exit !(v != "" && t != "" && d <= e) }' ||
    fail "$1: $2, expected $3 within $4"
  echo "$1: $2 (truth $3)"
}
# at_most WHAT VALUE BOUND
at_most() {
  awk -v v="$2" -v b="$3" 'BEGIN { exit !(v != "" && v + 0 <= b + 0) }' || fail "$1: $2, expected at most $3"
  echo "$1: $2 (at most $3)"
}
# at_least WHAT VALUE BOUND
at_least() {
  awk -v v="$2" -v b="$3" 'BEGIN { exit !(v != "" && v + 0 >= b + 0) }' || fail "$1: $2, expected at least $3"
  echo "$1: $2 (at least $3)"
}
