// A recording, and what was published of it, as a file that common viewers show.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/bridge/messages/view_layout.hpp"

namespace perimap {

struct ViewExportFiles {
  std::string recording;  // of devices, of what was published, or of both
  std::string samples;    // what was published, where that is a file of its own; empty: it is not
  std::string output;     // MCAP
  std::string layout;     // for the viewer, JSON
};

struct ViewExportSummary {
  std::uint64_t pictures = 0;
  std::uint64_t surfaces = 0;  // of them `shown` had something that may be shown
  std::uint64_t shown = 0;
  std::uint64_t ecg_values = 0;
  std::uint64_t transforms = 0;
  std::string world_frame;
  std::optional<ViewAim> aim;  // at the last surface that was shown, from behind the camera and above it
  // What is damaged, or not there; one line each. What is whole was exported.
  std::vector<std::string> warnings;
};

// All messages stand at the instant that they speak of, in UTC: pictures and what is drawn over them at their capture,
// surfaces at their valid_time, each value of the ECG at its own. Of an invalid surface there are words alone, and a
// scene that takes away what was shown before. `generator` names the program in the file.
[[nodiscard]] Expected<ViewExportSummary> export_view(const ViewExportFiles& files, const std::string& generator);

}  // namespace perimap
