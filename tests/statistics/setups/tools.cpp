// Tips of tools and noise of trackers.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/tracker_noise.hpp"
#include "drawn_setup.hpp"
#include "setups.hpp"

namespace perimap::test {

void tools(std::uint64_t seed, int trials, GoalReport& report) {
  std::vector<double> tip;
  MeanOfMeasured nees;
  for (int i = 0; i < trials; ++i) {
    Draw draw(seed + static_cast<std::uint64_t>(i));
    const Vector3d tip_T = Vector3d(0.0, 0.0, draw.uniform(80.0, 250.0)) + draw.vector(10.0);
    const Vector3d pivot_W = draw.vector(500.0);
    const HandMotion motion(draw, 0.0, 50.0);
    std::vector<TimedPose> poses;
    for (double t = 0.0; t < 20.0; t += 1.0 / 60.0) {
      Pose X;
      X.R = so3_exp(motion.at(t).head<3>());
      X.t = pivot_W - X.R * tip_T + draw.vector(kTracker_mm / std::sqrt(3.0));
      X.R = X.R * so3_exp(draw.vector(kTracker_deg * kDegree / std::sqrt(3.0)));
      poses.push_back({t, X});
    }
    const auto result = calibrate_pivot(poses);
    if (!result) {
      fmt::print("seed {}: {}\n", i, result.error().message);
      tip.push_back(99);
      continue;
    }
    const Vector3d e = result->tip_T - tip_T;
    tip.push_back(e.norm());
    nees.add(e.dot(result->covariance_T.inverse() * e) / 3.0);
  }
  report.at_most("tool's tip, mm, 95 %", 0.5, percentile(tip, 0.95));
  report.at_most("tools refused, %", kMostRefused_percent, nees.refused_percent(trials));
  report.within("tool's tip, NEES/3", 0.8, 1.2, nees.mean());
}

void trackers(std::uint64_t seed, int trials, GoalReport& report) {
  for (const auto& [correlation_s, lasting] : {std::pair(0.0, 1.0), {0.2, 1.0}, {1.0, 1.0}, {0.5, 0.65}}) {
    std::vector<double> position, rotation, factor;
    MeanOfMeasured nees, time_nees;
    for (int i = 0; i < trials; ++i) {
      Draw draw(seed + static_cast<std::uint64_t>(i));
      const double interval_s = 1.0 / 60.0;
      TrackerError error(draw, correlation_s, interval_s, lasting);
      std::vector<TimedPose> poses;
      const double duration_s = correlation_s < 0.5 ? 60.0 : 120.0;
      for (double t = 0.0; t < duration_s; t += interval_s) {
        poses.push_back({t, error.of({Matrix3d::Identity(), Vector3d(0.0, 100.0, -1200.0)})});
      }
      const auto noise = measure_tracker_noise(poses);
      if (!noise) {
        fmt::print("seed {}: {}\n", i, noise.error().message);
        position.push_back(99);
        continue;
      }
      position.push_back(100.0 * std::abs(noise->position_deviation_mm / kTracker_mm - 1.0));
      rotation.push_back(100.0 * std::abs(noise->rotation_deviation_deg / kTracker_deg - 1.0));
      const double position_off = (noise->position_deviation_mm - kTracker_mm) / noise->position_deviation_mm_deviation;
      const double rotation_off =
          (noise->rotation_deviation_deg - kTracker_deg) / noise->rotation_deviation_deg_deviation;
      nees.add((position_off * position_off + rotation_off * rotation_off) / 2.0);
      if (correlation_s == 0.0) {
        factor.push_back(1.0 + noise->correlation_s);
        continue;
      }
      const double off = std::log(std::max(1e-6, noise->correlation_s) / correlation_s);
      factor.push_back(std::exp(std::abs(off)));
      time_nees.add(std::pow(off / std::log(noise->correlation_s_factor), 2.0));
    }
    const std::string of = fmt::format(", {} error of {:g} s", lasting < 1.0 ? "two thirds an" : "an", correlation_s);
    const std::string what = of + ", 95 %";
    report.at_most("tracker's position noise, %" + what, 15.0, percentile(position, 0.95));
    report.at_most("tracker's rotation noise, %" + what, 15.0, percentile(rotation, 0.95));
    report.at_most("its correlation time, factor" + what, 2.0, percentile(factor, 0.95));
    report.at_most("trackers refused, %" + of, kMostRefused_percent, nees.refused_percent(trials));
    report.within("both noises, NEES/2" + of, 0.8, 1.2, nees.mean());
    if (correlation_s > 0.0) {
      report.within("the logarithm of its time, NEES" + of, 0.8, 1.2, time_nees.mean());
    }
  }
}

}  // namespace perimap::test
