#!/bin/bash
# Builds the benchmarks of the feature update, of recording, of the surface and of the patch tracker with the release preset
# and runs them. The row of Ceres needs libceres-dev and the tracker's comparison libopencv-video-dev, which
# deploy/install-packages.sh --full installs; without them the row, or the comparison, is left out.
set -euo pipefail
cd "$(dirname "$0")/../.."
cmake --preset release -DPERIMAP_TESTS=all > /dev/null
cmake --build --preset release --target update_bench -j "${1:-$(nproc)}"
build/release/tests/bench/update_bench
cmake --build --preset release --target recording_bench -j "${1:-$(nproc)}"
build/release/tests/bench/recording_bench
cmake --build --preset release --target surface_bench -j "${1:-$(nproc)}"
build/release/tests/bench/surface_bench
cmake --build --preset release --target mesh_client_bench -j "${1:-$(nproc)}"
build/release/tests/bench/mesh_client_bench
if ninja -C build/release -t query vision_bench > /dev/null 2>&1; then
  cmake --build --preset release --target vision_bench -j "${1:-$(nproc)}"
  build/release/tests/bench/vision_bench
else
  echo "libopencv-video-dev was not found at configure time: the patch tracker's comparison is left out."
fi
