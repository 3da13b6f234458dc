// Recorded motion of points on a heart: what an experiment on real traces reads.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct MotionTrace {
  std::vector<std::string> points;  // names, from the heading; "1", "2" without one
  double first_s = 0.0;
  double period_s = 0.0;      // mean, between samples
  Eigen::MatrixXd positions;  // mm; one row a sample, x y z of each point

  [[nodiscard]] Eigen::Index samples() const noexcept { return positions.rows(); }
};

// A column of times in seconds, then x, y, z of each point in mm; a heading or none. Refuses, by file and line, what is
// no number, columns that do not come in threes, times that do not go on evenly.
[[nodiscard]] Expected<MotionTrace> parse_motion_trace(std::string_view text, std::string_view name);
[[nodiscard]] Expected<MotionTrace> read_motion_trace(const std::filesystem::path& file);

// Times of R peaks in seconds, on the trace's clock, one a line and growing.
[[nodiscard]] Expected<std::vector<double>> parse_r_peaks(std::string_view text, std::string_view name);
[[nodiscard]] Expected<std::vector<double>> read_r_peaks(const std::filesystem::path& file);

}  // namespace perimap
