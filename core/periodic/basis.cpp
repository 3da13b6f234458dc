#include "core/periodic/basis.hpp"

#include <cmath>

namespace perimap {
namespace {

// Calls visit(k, cos k phase, sin k phase) for k = 1..harmonics. Turning a unit vector by the phase each time needs one
// sine and one cosine in all and loses about one rounding error a harmonic.
template <class Visit>
void for_each_harmonic(int harmonics, double phase_rad, Visit visit) noexcept {
  const double c1 = std::cos(phase_rad);
  const double s1 = std::sin(phase_rad);
  double c = 1.0;
  double s = 0.0;
  for (int k = 1; k <= harmonics; ++k) {
    const double next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
    visit(k, c, s);
  }
}

}  // namespace

Basis basis_at(const BasisLayout& layout, double cardiac_phase_rad, double respiratory_phase_rad) noexcept {
  Basis b(layout.size());
  b(0) = 1.0;
  const int H = layout.cardiac_harmonics;
  for_each_harmonic(H, cardiac_phase_rad, [&](int k, double c, double s) {
    b(k) = c;
    b(H + k) = -s;
  });
  const int H_r = layout.respiratory_harmonics;
  if (H_r > 0) {
    for_each_harmonic(H_r, respiratory_phase_rad, [&](int k, double c, double s) {
      b(2 * H + k) = c;
      b(2 * H + H_r + k) = -s;
    });
  }
  return b;
}

Basis basis_without_breath(const BasisLayout& layout, double cardiac_phase_rad) noexcept {
  Basis b = basis_at(layout, cardiac_phase_rad);
  b.tail(2 * layout.respiratory_harmonics).setZero();
  return b;
}

Basis breath_rate(const BasisLayout& layout, double respiratory_phase_rad) noexcept {
  Basis b = Basis::Zero(layout.size());
  const int first = 2 * layout.cardiac_harmonics;
  const int H_r = layout.respiratory_harmonics;
  for_each_harmonic(H_r, respiratory_phase_rad, [&](int k, double c, double s) {
    b(first + k) = -k * s;
    b(first + H_r + k) = -k * c;
  });
  return b;
}

Basis basis_rate(const BasisLayout& layout, double cardiac_phase_rad) noexcept {
  Basis b = Basis::Zero(layout.size());
  const int H = layout.cardiac_harmonics;
  for_each_harmonic(H, cardiac_phase_rad, [&](int k, double c, double s) {
    b(k) = -k * s;
    b(H + k) = -k * c;
  });
  return b;
}

}  // namespace perimap
