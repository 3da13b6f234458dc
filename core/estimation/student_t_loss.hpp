// The loss of Student's t with 3 degrees of freedom, for the squared Mahalanobis residual s of a two-dimensional
// measurement: it lets go of gross outliers.
#pragma once

#include <cmath>

namespace perimap {

inline constexpr double kStudentFreedom = 3.0;  // nu

// -2 log of the bivariate density: (nu + 2) log(1 + s / nu), and its derivative, the measurement's weight.
[[nodiscard]] inline double student_t_loss(double s) noexcept {
  return (kStudentFreedom + 2.0) * std::log1p(s / kStudentFreedom);
}
[[nodiscard]] inline double student_t_weight(double s) noexcept {
  return (kStudentFreedom + 2.0) / (kStudentFreedom + s);
}

}  // namespace perimap
