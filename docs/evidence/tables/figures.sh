# Read by ../make.sh: recordings, replays, and the figures of one replay from its own words.

# simulate STEM OPTION...: makes the recording $work/STEM.mcap unless it is there.
simulate() {
  local stem=$1
  shift
  [ -e "$work/$stem.mcap" ] && return 0
  is_there "$perimap" || return 1
  "$perimap" simulate "$work/$stem.mcap" "$@" > "$work/$stem.log" 2>&1 || { cat "$work/$stem.log" >&2; return 1; }
}

# replay STEM NAME: in lockstep with the configuration read from standard input; its words go to $work/NAME.txt.
replay() {
  is_there "$perimap" || return 1
  { echo 'version = 1'; cat; } > "$work/$2.toml"
  "$perimap" replay "$work/$1.mcap" -c "$work/$2.toml" --lockstep > "$work/$2.txt" 2> "$work/$2.log" ||
    { cat "$work/$2.log" >&2; return 1; }
}

# figure NAME WHICH: of $work/NAME.txt.
figure() {
  local pattern
  case $2 in
    rms) pattern='s/^error .*RMS \([0-9.]*\) mm.*/\1/p' ;;
    median) pattern='s/^error .*median \([0-9.]*\) mm.*/\1/p' ;;
    p95) pattern='s/^error .*95th percentile \([0-9.]*\) mm.*/\1/p' ;;
    largest) pattern='s/^error .*largest \([0-9.]*\) mm.*/\1/p' ;;
    nees) pattern='s/^consistency mean NEES\/3 \([0-9.]*\).*/\1/p' ;;
    converged) pattern='s/^features .* \([0-9]*\) converged.*/\1/p' ;;
    early) pattern='s/^features .* \([0-9]*\) of them within 15 s.*/\1/p' ;;
    off) pattern='s/^good  *\([0-9]* of [0-9]*\) positions.*/\1/p' ;;
  esac
  local value
  value=$(sed -n "$pattern" "$work/$1.txt" | head -n 1)
  printf '%s' "${value:-none}"
}
