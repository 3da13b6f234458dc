// What set-ups are drawn from: numbers, motions as of a hand, lenses, boards, a tracker's errors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap::test {

inline constexpr double kTracker_mm = 1.4;   // RMS of the 3-D norm
inline constexpr double kTracker_deg = 0.5;  // likewise

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : generator_(seed) {}
  double normal(double deviation) { return deviation * normal_(generator_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vector3d vector(double deviation) { return {normal(deviation), normal(deviation), normal(deviation)}; }
  bool chance(double share) { return uniform(0.0, 1.0) < share; }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

// A smooth motion as of a hand: sines of drawn periods, amplitudes and phases.
class HandMotion {
 public:
  HandMotion(Draw& draw, double mm, double deg);
  // Rotation, rad, then translation, mm.
  [[nodiscard]] Vector6d at(double t_s) const;

 private:
  double mm_;
  double deg_;
  std::array<std::array<std::array<double, 3>, 3>, 6> waves_{};
};

// A tracker's error, stationary: this share of its variance is first-order Gauss-Markov of one correlation time, and
// the rest new in each pose; all of it where that time is 0.
class TrackerError {
 public:
  TrackerError(Draw& draw, double correlation_s, double interval_s, double lasting_share = 1.0);
  // The next pose's: X as the tracker has it.
  Pose of(const Pose& X);

 private:
  Draw& draw_;
  double rho_;
  double lasting_;
  Vector3d place_;
  Vector3d turn_;
};

// Of 1280x720 pictures.
CameraModel drawn_camera(Draw& draw);

// Inner corners, row by row, from the first.
std::vector<Vector3d> chessboard(int columns, int rows, double square_mm);

using Vector7d = Eigen::Matrix<double, 7, 1>;

// Squared errors of a hand-eye by their covariances, by number: of rotation, place, and the clocks' offset, each by its
// own block, and of all together.
struct HandEyeNees {
  double rotation = 0.0, translation = 0.0, offset = 0.0, all = 0.0;
};
HandEyeNees nees_of(const Vector7d& error, const Eigen::Matrix<double, 7, 7>& covariance);

// Over the trials that were not refused.
class MeanOfMeasured {
 public:
  void add(double value) { sum_ += value, count_ += 1; }
  // Not a number of none.
  [[nodiscard]] double mean() const;
  // Of so many trials, those that added nothing.
  [[nodiscard]] double refused_percent(int trials) const { return 100.0 * (trials - count_) / trials; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

// Trials that may be refused, of which a deviation then says nothing.
inline constexpr double kMostRefused_percent = 2.0;

// Below which this share of the values lies.
double percentile(std::vector<double> values, double share);

}  // namespace perimap::test
