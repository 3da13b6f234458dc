// Errors of a feature's matches that come again with the view, and so do not average out.
#pragma once

#include <Eigen/LU>

#include "core/geometry/pose.hpp"

namespace perimap {

// Curvature, relief and light make of a template's place another one in each view: the same one each time that the
// view comes again, with the next beat or when the scope is back. The recursion takes matches as new ones, and its
// covariance falls with their number. But a match's own error is new only as long as its view is: beyond so many
// matches, what it leaves in the estimate falls no more.
class RepeatedErrors {
 public:
  // An update by a match whose noise R has `own` of the match (px^2), not of its pose or phase. It stands for so many
  // matches at the usual rate.
  void add(const Matrix2d& own, const Matrix2d& R, double usual_matches) noexcept {
    matches_ += usual_matches;
    own_ += usual_matches * 0.5 * (R.inverse() * own).trace();
  }

  // diffuse() has added to the estimate, whose largest deviation was so large (mm; 0: not known): what it is told from
  // now on counts for so much more.
  void fade(double largest_deviation_mm, double diffused_mm) noexcept {
    // What a step of all harmonics adds to a position's variance, 1 + sum 1/k^2 of the step's.
    constexpr double kOfPosition = 2.5;
    const double variance = largest_deviation_mm * largest_deviation_mm;
    const double added = kOfPosition * diffused_mm * diffused_mm;
    if (!(added > 0.0)) return;
    matches_ *= variance / (variance + added);
    own_ *= variance / (variance + added);
  }

  // The estimate's covariance is so many times that of the recursion.
  [[nodiscard]] double factor() const noexcept {
    return matches_ > kNewMatches ? 1.0 + own_ * (1.0 / kNewMatches - 1.0 / matches_) : 1.0;
  }

 private:
  static constexpr double kNewMatches = 500.0;  // docs/decisions/0104

  double matches_ = 0.0;
  double own_ = 0.0;  // of these, by the share that the matches' own errors have in their noise
};

}  // namespace perimap
