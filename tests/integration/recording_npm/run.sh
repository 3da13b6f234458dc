#!/bin/sh
# run.sh SOURCE_FOLDER WORK_FOLDER WRITE_RECORDING
# Installs the packages of package-lock.json into the work folder, writes a recording and checks it with them.
# Exit code 77: skipped, with the reason on standard output.
set -eu
source_folder=$1
work_folder=$2
write_recording=$3

for program in node npm; do
  if ! command -v $program >/dev/null; then
    echo "SKIPPED: $program is not installed"
    exit 77
  fi
done

mkdir -p "$work_folder"
cp "$source_folder/package.json" "$source_folder/package-lock.json" "$source_folder/check_recording.mjs" "$work_folder"
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

"$write_recording" recording.mcap expected.json
node check_recording.mjs recording.mcap expected.json
