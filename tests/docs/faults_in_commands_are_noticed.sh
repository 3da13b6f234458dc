#!/bin/bash
# faults_in_commands_are_noticed.sh PERIMAP: commands_in_documents.sh finds a command that is none, and an option that is
# none or another command's, also in a line that goes on, and among the options that are the value of one.
set -uo pipefail
perimap=$(realpath "$1")
checks=$(cd "$(dirname "$0")" && pwd)/commands_in_documents.sh
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir -p "$root/docs/guide"
{
  echo '```sh'
  for _ in $(seq 40); do echo 'build/dev/daemon/perimap check devices.toml  # --nothing of this'; done
  echo 'perimap nosuch file'
  echo 'perimap calibrate camera --nosuch'
  printf 'perimap calibrate tool poses.csv \\\n  --square-mm 8\n'
  echo 'perimap replay --lockstep --simulated "--seed 7 --samples x" --json a.json'
  echo '```'
} > "$root/README.md"
echo 'perimap neither --here' > "$root/docs/guide/a.md"
found=$("$checks" "$perimap" "$root") && { echo "FAILED: nothing was noticed: $found"; exit 1; }
for fault in 'perimap nosuch: is no command' 'perimap calibrate camera: --nosuch is no option of it' \
  'perimap calibrate tool: --square-mm is no option of it' \
  'perimap simulate: --samples is no option of it' '45 commands, 4 faults'; do
  grep -qF -- "$fault" <<< "$found" || { echo "FAILED: not noticed: $fault: $found"; exit 1; }
done
