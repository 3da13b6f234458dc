// A bench on which a set-up is measured, as a recording: what camera and tracker give, and nothing of the truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/error/expected.hpp"
#include "drivers/standins/simulator/bench_scene.hpp"

namespace perimap {

// Renders on so many threads; equal scenes give equal bytes whatever their number. The file gets its name only when it
// is whole. `progress` hears of frames, or of poses where the camera is off.
[[nodiscard]] Expected<void> write_bench(const BenchScene& scene, const std::filesystem::path& path,
                                         const TrackerNoise& noise, unsigned threads,
                                         const std::function<void(std::uint64_t done)>& progress);

// What the calibration has to find, as JSON with the names that `perimap calibrate --json` has.
[[nodiscard]] std::string true_setup_of(const BenchScene& scene, const TrackerNoise& noise);

// The landmarks of the patient's image as `perimap register --model` reads them: name,x,y,z in metres.
[[nodiscard]] std::string landmark_table_of(const BenchScene& scene);

}  // namespace perimap
