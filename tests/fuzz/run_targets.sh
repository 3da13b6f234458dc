#!/bin/bash
# run_targets.sh JOBS PROGRAMS CORPUS LOGS: a minute of each fuzz target of the folder PROGRAMS, JOBS of them at once.
# Each starts from the seeds of its own name, where there are any, and adds what it finds to CORPUS. Exit code 1 when one
# found something, or when there is none; what it found, and its log, are in LOGS.
set -uo pipefail
jobs=$1 programs=$2 corpus=$3 logs=$4

export corpus logs seeds=${0%/*}/corpus
run_one() {
  local target=$1 name=${1##*/fuzz_}
  mkdir -p "$corpus/$name"
  local folders=("$corpus/$name")
  if [ -d "$seeds/$name" ]; then folders+=("$seeds/$name"); fi
  local log=$logs/${target##*/}.log
  if timeout --kill-after=10 3m "$target" -max_total_time=60 -timeout=10 -rss_limit_mb=2048 -artifact_prefix="$logs/$name-" \
    "${folders[@]}" > "$log" 2>&1 < /dev/null; then
    echo "$name: $(grep -aoE 'Done [0-9]+ runs in [0-9]+ second' "$log" | tail -n 1)s, no finding"
  else
    echo "$name: FAILED; the end of $log:"
    tail -n 40 "$log"
    return 1
  fi
}
export -f run_one

targets=()
for target in "$programs"/fuzz_*; do
  if [ -f "$target" ] && [ -x "$target" ]; then targets+=("$target"); fi
done
if [ ${#targets[@]} -eq 0 ]; then
  echo "no fuzz targets in $programs" >&2
  exit 1
fi
printf '%s\n' "${targets[@]}" | xargs -P "$jobs" -I{} bash -c 'run_one "$1" || exit 1' run_one {} |
  awk -v n="${#targets[@]}" '/no finding|FAILED/ { printf "%d/%d ", ++done, n } { print; fflush() }'
exit $((PIPESTATUS[1] != 0))
