#include "core/periodic/periodic_motion.hpp"

namespace perimap {

Eigen::Vector3d position_of(const StateVector& x, const Basis& b) noexcept {
  const Eigen::Index n = b.size();
  return {x.segment(0, n).dot(b), x.segment(n, n).dot(b), x.segment(2 * n, n).dot(b)};
}

Eigen::Vector3d velocity_of(const StateVector& x, const Basis& b_rate, double phase_rate_rad_per_s) noexcept {
  return phase_rate_rad_per_s * position_of(x, b_rate);
}

StateVector to_paper_order(const StateVector& x) noexcept {
  const int size = static_cast<int>(x.size());
  StateVector x_paper(size);
  for (int i = 0; i < size; ++i) x_paper(paper_index(size / 3, i)) = x(i);
  return x_paper;
}

StateVector from_paper_order(const StateVector& x_paper) noexcept {
  const int size = static_cast<int>(x_paper.size());
  StateVector x(size);
  for (int i = 0; i < size; ++i) x(i) = x_paper(paper_index(size / 3, i));
  return x;
}

}  // namespace perimap
