// Features followed through a video or the frames of a recording by their looks alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/process/stop_signal.hpp"

namespace perimap {

struct FollowSettings {
  std::string input;                  // a video file or a recording
  std::string table;                  // where the tracks go (TrackTable)
  std::string video;                  // where the frames with their features marked go; empty: nowhere
  int features = 200;                 // how many are kept followed
  bool first_features_alone = false;  // those found in the first frame that shows any
};

struct FollowSummary {
  bool stopped = false;  // by a signal
  std::uint64_t frames = 0;
  std::uint64_t poor_frames = 0;  // in which fewer than a tenth of the features wanted were found
  std::size_t rows = 0;           // of the table
  double follow_s = 0.0;          // spent in following
  std::vector<Error> damage;      // of the input
  std::optional<Error> broken;    // ended the reading; what was found until then is written
};

// `progress` hears of each frame, and how many the input announces (0: it does not).
[[nodiscard]] Expected<FollowSummary> follow_features(
    const FollowSettings& settings, StopSignal& stop,
    const std::function<void(std::uint64_t frames, std::uint64_t all)>& progress);

// What a user should know of how few features there were; a line each.
[[nodiscard]] std::vector<std::string> warnings(const FollowSummary& summary, const FollowSettings& settings);
[[nodiscard]] std::string to_text(const FollowSummary& summary, const FollowSettings& settings);

}  // namespace perimap
