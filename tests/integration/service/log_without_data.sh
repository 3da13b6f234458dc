#!/bin/bash
# A log holds words and few figures: no picture, no ECG, no position. Faults are printed; exit code 1 then.
# log_without_data.sh LOG...
# log_without_data.sh --faults: whether each kind of data is told
set -uo pipefail

faults_of() { # LOG
  [ "$(wc -l < "$1")" -ge 5 ] || echo "$1 has $(wc -l < "$1") lines"
  LC_ALL=C grep -n '[^ -~]' "$1" | sed "s|^|$1: bytes that are no text: |"
  awk -v log_file="$1" 'length > 400 { print log_file ": as long as data: " $0 }' "$1"
  # Three figures with decimals in a row are a position, ten of any kind a piece of an ECG.
  grep -nE '(-?[0-9]+\.[0-9]+[ ,;]+){2}-?[0-9]+\.[0-9]+|(-?[0-9.]+[ ,;]+){9}-?[0-9]' "$1" |
    sed "s|^|$1: a row of figures: |"
}

if [ "${1:-}" = --faults ]; then
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  words=$(printf 'perimapd: 2026-11-27 01:44:16.372 info: ECG: starting\n%.0s' 1 2 3 4 5)
  echo "$words" > "$work/log"
  [ -z "$(faults_of "$work/log")" ] || { echo "FAILED: words are told: $(faults_of "$work/log")"; exit 1; }
  for data in 'feature 7 at -12.25, 3.5, 88.125 mm' 'ecg 1 2 2 3 5 8 13 9 4 2 1' $'\x89PNG' \
    "$(printf 'iVBORw0KGgo%.0s' $(seq 50))"; do
    { echo "$words" && echo "$data"; } > "$work/log"
    [ -n "$(faults_of "$work/log")" ] || { echo "FAILED: not told: $data"; exit 1; }
  done
  echo "as promised"
  exit 0
fi

found=$(for log in "$@"; do faults_of "$log"; done)
[ -z "$found" ] && exit 0
echo "$found" | cut -c 1-500 | head -n 20
exit 1
