// Where features that were drawn over a simulated recording's pictures truly were: a feature is the material point that
// the ray of its first detection meets. What cannot be read is thrown as a std::runtime_error.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"

namespace perimap::test {

[[nodiscard]] RecordedTruth truth_of(const std::string& recording);

// What was published of the recording, as `perimap watch --record` and `perimap replay --samples` keep it.
struct PublishedPlaces {
  std::map<std::uint32_t, std::pair<Instant, Vector2d>> first_views;  // by id
  std::map<std::uint64_t, Pose> cameras;                              // by frame sequence
  std::optional<Duration> to_recording;
  // That came before it was time for the next: a beat has become known, or the state is another.
  int models_for_a_turn = 0;
};
[[nodiscard]] PublishedPlaces read_published_places(const std::string& samples, const RecordedTruth& truth);

// As the scope was turned and zoomed then.
[[nodiscard]] CameraModel lens_at(const RecordedTruth& truth, Instant capture);

// The pixel of a feature's material point in a frame, seen from X_WC; nothing where its first ray met no surface, or
// where it is beside the picture. One that no model had is thrown.
[[nodiscard]] std::optional<Vector2d> true_pixel(const RecordedTruth& truth, const PublishedPlaces& published,
                                                 std::uint32_t feature, Instant capture, const Pose& X_WC);

}  // namespace perimap::test
