// Whether what an earlier run left may be gone on with.
#pragma once

#include <filesystem>
#include <string>

#include "core/error/expected.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// Of this run.
struct Now {
  std::string boot;
  Instant monotonic;
  std::int64_t utc_ns = 0;
  Duration suspended{0};  // as Checkpoint has it
};
[[nodiscard]] Now this_boot_now();

[[nodiscard]] SetUp set_up_of(const Configuration& configuration, const PipelineSettings& pipeline);

// What may be used of it: everything in the same boot, unless the machine has slept since; else the map without ECG,
// frame times and the breath's phase, its instants moved to where they are by this run's clock. An error says why
// nothing may: another camera, hand-eye transform, time offset, patient's frame or estimator, or too old.
[[nodiscard]] Expected<MapMemory> usable_memory(Checkpoint checkpoint, const SetUp& set_up, const Now& now,
                                                Duration maximum_age);

// The same from a file. An error says why it may not be used, or that there is none.
[[nodiscard]] Expected<MapMemory> load_memory(const std::filesystem::path& file, const SetUp& set_up,
                                              Duration maximum_age);

}  // namespace perimap
