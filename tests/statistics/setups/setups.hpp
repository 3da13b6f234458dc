// What is measured of drawn set-ups, each a function of its seed; trial i is drawn by seed + i.
#pragma once

#include <cstddef>
#include <cstdint>

#include "daemon/setup/camera_calibration.hpp"
#include "goal_report.hpp"

namespace perimap::test {

// `correlation_s`: how long the tracker's error lasts; 0: each pose's is new.
void hand_eyes(std::uint64_t seed, int trials, double correlation_s, GoalReport& report);
// Of focal lengths and principal point, over four.
[[nodiscard]] double lens_nees_of(const CameraCalibration& result, const CameraModel& truth);
void cameras(std::uint64_t seed, int trials, std::size_t view_count, GoalReport& report);
// A table of what few views, and views of a part of the picture, tell; only the deviations are judged.
void few_views(std::uint64_t seed, int trials, GoalReport& report);
void tools(std::uint64_t seed, int trials, GoalReport& report);
void trackers(std::uint64_t seed, int trials, GoalReport& report);
void scopes(std::uint64_t seed, int trials, GoalReport& report);
// Lens, hand-eye, offset, tool and registration, one after the other as a user measures them.
void whole_setups(std::uint64_t seed, int trials, GoalReport& report);

}  // namespace perimap::test
