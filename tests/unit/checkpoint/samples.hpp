// A checkpoint whose every member has a value of its own.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/checkpoint/checkpoint_file.hpp"

namespace perimap::test {

[[nodiscard]] FeatureMemory feature_sample(std::uint32_t id);
[[nodiscard]] RespirationMemory respiration_sample();
[[nodiscard]] SetupMemory setup_sample();
// Without features.
[[nodiscard]] Checkpoint checkpoint_sample();

// The file, with so many samples of features.
[[nodiscard]] std::string file_of(const Checkpoint& c, int features = 2);

}  // namespace perimap::test
