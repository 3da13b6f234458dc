#!/bin/bash
# With hardly a file that may be open, each program ends with a sentence that names the limit, and none by a signal.
#   limits_are_told.sh PERIMAP PERIMAPD CONFIGURATION
set -uo pipefail
perimap=$1
perimapd=$2
configuration=$3
failed=0

tried() { # LIMIT COMMAND...: what it says, with its code in $code
  local limit=$1
  shift
  told=$(
    exec 3>&- 4>&- 5>&- 6>&- 7>&- 8>&- 9>&-  # what the caller had open counts
    ulimit -n "$limit"
    timeout 20 "$@" 2>&1
  )
  code=$?
}
for limit in 4 5 6 8 12 16 24 40 63; do
  for command in "$perimapd -c $configuration" "$perimap watch --wait 0.2 --domain 117" "$perimap check $configuration"; do
    # shellcheck disable=SC2086
    tried $limit $command
    if [ $code -ne 1 ]; then
      echo "FAILED: $command with $limit files ended with $code: $told"
      failed=1
    elif [ "$limit" -ge 8 ] && ! grep -q "at most $limit files may be open at a time: expected a limit of at least 64" <<< "$told"; then
      echo "FAILED: $command with $limit files said: $told"
      failed=1
    fi
  done
done
# A soft limit that may be raised is.
told=$(
  ulimit -S -n 8
  timeout 20 "$perimap" watch --wait 0.2 --domain 117 2>&1
)
grep -q 'no surface was received in DDS domain 117' <<< "$told" || {
  echo "FAILED: a limit that may be raised was not: $told"
  failed=1
}
exit $failed
