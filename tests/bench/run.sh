#!/bin/bash
# Builds the benchmark of the feature update with the release preset and runs it. The row of Ceres needs libceres-dev,
# which deploy/install-packages.sh --full installs; without it the program says that the row is left out.
set -euo pipefail
cd "$(dirname "$0")/../.."
cmake --preset release > /dev/null
cmake --build --preset release --target update_bench -j "${1:-$(nproc)}"
build/release/tests/bench/update_bench
