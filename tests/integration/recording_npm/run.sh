#!/bin/sh
# run.sh SOURCE_FOLDER WORK_FOLDER SCRIPT RECORDING EXPECTED PROGRAM
# Installs the packages of package-lock.json into the work folder, lets the program write a recording and what is expected
# of it, and checks it by the script with them.
# Exit code 77: skipped, with the reason on standard output.
set -eu
source_folder=$1
work_folder=$2
script=$3
recording=$4
expected=$5
program=$6

for needed in node npm; do
  if ! command -v $needed >/dev/null; then
    echo "SKIPPED: $needed is not installed"
    exit 77
  fi
done

mkdir -p "$work_folder"
cp "$source_folder/package.json" "$source_folder/package-lock.json" "$source_folder/$script" "$work_folder"
cd "$work_folder"
if ! cmp -s package-lock.json installed-lock.json; then
  if ! npm ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=30000; then
    if ! npm ping --fetch-retries=0 --fetch-timeout=30000 >/dev/null 2>&1; then
      echo "SKIPPED: the npm registry cannot be reached"
      exit 77
    fi
    exit 1
  fi
  cp package-lock.json installed-lock.json
fi

"$program" "$recording" "$expected"
node "$script" "$recording" "$expected"
