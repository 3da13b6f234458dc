#include "core/phase/ventricular_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kAlways = -7.7;
constexpr double kArea = 1.3;
constexpr double kKindArea = 5.3;
constexpr double kOtherShape = 6.9;
constexpr double kInterval = -9.2;
constexpr double kIntervalBefore = 5.2;
constexpr double kBent = 0.1;  // strangeness, from which on a shape is another and more says no more

}  // namespace

double log_odds(const VentricularEvidence& evidence) noexcept {
  return kAlways + kArea * evidence.log_area + kKindArea * evidence.log_kind_area +
         kOtherShape * std::min(evidence.strangeness / kBent, 1.0) + kInterval * evidence.log_rr +
         kIntervalBefore * evidence.log_rr_before;
}

double area(const QrsShape& shape) noexcept {
  double value = 0.0;
  double covered = 0.0;
  for (int i = 0; i < shape.points; ++i) {
    value += static_cast<double>(shape.slope[static_cast<std::size_t>(i)]);
    covered += std::abs(value);
  }
  return covered;
}

}  // namespace perimap
