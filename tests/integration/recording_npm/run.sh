#!/bin/bash
# run.sh SOURCE_FOLDER WORK_FOLDER SCRIPT RECORDING EXPECTED PROGRAM
# Installs the packages of package-lock.json into the work folder, lets the program write a recording and what is expected
# of it, and checks it by the script with them.
# Exit code 77: skipped, with the reason on standard output.
set -eu
work_folder=$2 script=$3 recording=$4 expected=$5 program=$6
. "$(dirname "$0")/../npm_packages.sh"
npm_packages "$1" "$work_folder" "$script"
cd "$work_folder"
"$program" "$recording" "$expected"
node "$script" "$recording" "$expected"
