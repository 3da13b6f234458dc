// Poses and signals over time as tables, the files that `perimap calibrate` takes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/calibration/time_correlation.hpp"
#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"
#include "drivers/pose_file/table_times.hpp"

namespace perimap {

enum class LengthUnit { kMetre, kMillimetre };

struct PoseTable {
  std::vector<TimedPose> poses;  // in the file's order, mm
  std::size_t dropouts = 0;      // rows without a pose: empty, not a number, or a quaternion of zeros
};

// Eight columns t_s,x,y,z,qx,qy,qz,qw whatever the heading calls them; or 13 or 17: the time and the first three or all
// four rows of a matrix. Errors name the file, line and what is wrong: a quaternion whose norm is not 1, a matrix that
// is no rotation, positions that no tracker can measure in this unit, times that are no seconds where none is said.
[[nodiscard]] Expected<PoseTable> parse_pose_table(std::string_view text, std::string_view name, LengthUnit unit,
                                                   std::optional<TimeUnit> times = std::nullopt);
[[nodiscard]] Expected<PoseTable> read_pose_table(const std::filesystem::path& file, LengthUnit unit,
                                                  std::optional<TimeUnit> times = std::nullopt);

struct SignalTable {
  std::vector<TimedValue> values;  // in the order of their times
  std::size_t dropouts = 0;        // rows without a number
  bool several_columns = false;    // `values` are then along the direction in which they vary most
};

// A time and one value a row, or several: then their principal component.
[[nodiscard]] Expected<SignalTable> parse_signal_table(std::string_view text, std::string_view name,
                                                       std::optional<TimeUnit> times = std::nullopt);
[[nodiscard]] Expected<SignalTable> read_signal_table(const std::filesystem::path& file,
                                                      std::optional<TimeUnit> times = std::nullopt);

}  // namespace perimap
