// What a subscriber recorded, against the truth of the recording that was replayed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

// Quantiles over all samples.
struct DurationFigures {
  Duration p50{0};
  Duration p99{0};
  Duration max{0};
};

struct SamplesReport {
  AccuracyReport accuracy;
  std::uint64_t samples = 0;
  std::uint64_t missed = 0;         // gaps in the sample sequence
  std::uint64_t without_frame = 0;  // published at a fitted frame time because no frame came
  std::uint64_t from_late_update = 0;
  DurationFigures capture_to_receipt;
  DurationFigures release_to_receipt;  // receipt minus the release's deadline
  DurationFigures jitter;              // |receipt minus deadline - its median|
};

// Of one stream; with an empty name of the only one there is. Fails when the recording has no ground truth, the samples
// are not of this recording, or which stream is meant is not told. `X_IW` as load_truth() has it.
[[nodiscard]] Expected<SamplesReport> report_samples(const std::string& recording, const std::string& samples,
                                                     const std::string& stream, ReadMode mode,
                                                     const std::optional<Pose>& X_IW = std::nullopt);

}  // namespace perimap
