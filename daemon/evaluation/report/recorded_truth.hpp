// The ground truth of a simulated recording, and the clock on which it was published.
#pragma once

#include <perimap.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/standins/truth/ground_truth.hpp"

namespace perimap {

// What happened in a simulated procedure.
struct RecordedEvent {
  std::string kind;
  std::string words;  // what it was, for people
  Instant begin, end;
  bool hides = false;  // meanwhile the organ could hardly be seen
};

struct RecordedTruth {
  GroundTruth truth;
  CameraModel camera;
  std::map<std::uint64_t, Instant> captures;  // by frame sequence
  std::vector<RecordedEvent> events;          // in order; none without a procedure

  // What to add to the instants of samples to come to the recording's clock, told by one published frame. Nothing when
  // the recording has no such frame.
  [[nodiscard]] std::optional<Duration> to_recording(std::uint64_t frame_sequence, Instant published_capture) const {
    const auto capture = captures.find(frame_sequence);
    if (capture == captures.end()) return std::nullopt;
    return capture->second - published_capture;
  }
};

// The surface says of nothing that hides whether its frame came, so that its capture is the frame's own.
[[nodiscard]] constexpr bool rests_on_its_frame(perimap_SurfaceReason reason) noexcept {
  return reason == perimap_SURFACE_REASON_NONE || reason == perimap_SURFACE_REASON_ECTOPIC_BEAT ||
         reason == perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE || reason == perimap_SURFACE_REASON_RHYTHM_ECTOPIC ||
         reason == perimap_SURFACE_REASON_LAW_UNDECIDED || reason == perimap_SURFACE_REASON_NOT_SEEN ||
         reason == perimap_SURFACE_REASON_NO_PARALLAX || reason == perimap_SURFACE_REASON_NOTHING_CONVERGED ||
         reason == perimap_SURFACE_REASON_SETUP_DOUBTED || reason == perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED ||
         reason == perimap_SURFACE_REASON_ORGAN_MOVED || reason == perimap_SURFACE_REASON_TRACKER_ERRS ||
         reason == perimap_SURFACE_REASON_SETUP_UNCERTAIN;
}

// Nothing when the recording has no ground truth (it is not a simulated one). `X_IW`: the registration, where positions
// are to be held against it in the frame of the patient's image; refused of a heart that is moved by a procedure or a
// trace, which are told in the tracker's frame.
[[nodiscard]] Expected<std::optional<RecordedTruth>> load_truth(const std::string& recording, ReadMode mode,
                                                                const std::optional<Pose>& X_IW = std::nullopt);

}  // namespace perimap
