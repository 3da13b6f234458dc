#!/bin/bash
# Builds the benchmarks of the feature update, of recording, of the surface and of the patch tracker with the release preset
# and runs them.
set -euo pipefail
cd "$(dirname "$0")/../.."
cmake --preset release -DPERIMAP_TESTS=all > /dev/null
for bench in update_bench recording_bench surface_bench mesh_client_bench vision_bench; do
  cmake --build --preset release --target $bench -j "${1:-$(nproc)}"
  build/release/tests/bench/$bench
done
