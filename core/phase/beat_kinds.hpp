// The kinds of beats that a patient has, and how unlike the usual one a beat is.
//
// A kind has one shape and one size: ventricular beats may have the usual shape to a correlation of 0.9 and more, and
// are told by it all the same where usual beats are alike to 0.99. So what counts is the difference from the usual
// beat, point by point, in the variances that usual beats have there: the diagonal Mahalanobis distance.
#pragma once

#include <array>

#include "core/phase/qrs_shape.hpp"

namespace perimap {

class BeatKinds {
 public:
  // Of a beat with the kinds before it.
  struct Comparison {
    int kind = -1;       // that it is of; -1: it begins one
    bool usual = false;  // it is of the usual kind
    double unlike =
        0.0;  // mean square of the differences from the usual beat, in the usual variances; 0: none is known
    double narrower = 0.0;  // than the usual beat: logarithm of how fast its slope changes, to that; 0: none is known
    bool recurs = false;    // its kind has recurred,
    bool apart = false;     // and is far from the usual one
    bool coupled = false;   // its kind is another than the usual one, and comes early by about the same time
    double log_rr = 0.0;    // of the intervals before its kind to the cycle, mean,
    double scatter = 0.0;   // and mean deviation of that; 0: not known
  };
  [[nodiscard]] Comparison compare(const QrsShape& shape) const noexcept;

  // The beat was one. `log_rr`: of its interval to the rhythm's cycle, 0 where that is not known. Gives its kind, -1
  // for a shape of no points.
  int learn(const QrsShape& shape, const Comparison& compared, double log_rr) noexcept;

 private:
  static constexpr int kKinds = 8;

  struct Kind {
    QrsShape shape;  // fading mean
    std::array<float, QrsShape::kCapacity> variance{};
    double weight = 0.0;   // beats, older ones fading; 0: free
    double members = 0.0;  // bounded
    double intervals = 0.0;
    double log_rr = 0.0;  // fading mean,
    double log_rr_deviation = 0.0;
  };

  [[nodiscard]] int usual() const noexcept;  // -1 when there is none
  [[nodiscard]] const Kind& at(int i) const noexcept { return kinds_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] static double unlike(const QrsShape& shape, const Kind& usual) noexcept;
  static void learn_variance(const QrsShape& shape, Kind& kind) noexcept;
  static void learn_interval(double log_rr, Kind& kind) noexcept;

  std::array<Kind, kKinds> kinds_{};
};

}  // namespace perimap
