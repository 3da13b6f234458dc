// The published distances of a simulated tool against its true one.
#pragma once

#include <perimap_tool.h>

#include <array>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "core/tool/tool_distance.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

// A number that nothing was counted for is none.
struct ToolFigures {
  std::size_t samples = 0;  // from 15 s on
  std::size_t usable = 0;   // of them, not invalid
  struct Errors {
    std::size_t samples = 0;
    std::optional<double> rms_mm, p95_mm, nees;  // mean of the squared error by its variance
  };
  std::array<Errors, kToolHorizons.size()> horizons;
  Errors near;                   // now, at most 5 mm from the surface
  std::size_t touches = 0;       // that a usable sample was there for
  std::size_t touches_told = 0;  // by a sample within half a second
  // Of those: from when the tip came to the surface until a sample said so, in frames; negative: before.
  std::optional<double> told_frames_median, told_frames_worst;
  std::optional<double> told_share;   // of the samples while it touched
  std::optional<double> false_share;  // of the samples while it was 2 mm away or more
};

// By the tool's name; none in a recording without simulated tools.
using ToolTruths = std::map<std::string, std::vector<perimap_TruthTool>>;
[[nodiscard]] Expected<ToolTruths> load_tool_truths(const std::string& recording, ReadMode mode);

// Takes the samples of one tool as they are published, on the clock of the recording.
class ToolTally {
 public:
  // `truth`: in order of time. It must outlive it.
  explicit ToolTally(const std::vector<perimap_TruthTool>& truth) : truth_(truth) {}

  void add(const perimap_ToolDistance& sample) { samples_.push_back(sample); }
  [[nodiscard]] ToolFigures figures() const;

 private:
  // Of the tip at t; none before the first and after the last.
  struct Truth {
    double distance_mm = 0.0;
    bool touches = false;
  };
  [[nodiscard]] std::optional<Truth> truth_at(std::int64_t t_ns) const;
  void judge_touches(std::int64_t from_ns, ToolFigures& figures) const;

  const std::vector<perimap_TruthTool>& truth_;
  std::vector<perimap_ToolDistance> samples_;
};

[[nodiscard]] nlohmann::json to_json(const ToolFigures& figures);
[[nodiscard]] std::string to_text(const std::string& tool, const ToolFigures& figures);

}  // namespace perimap
