// The Fourier basis b(phi) that turns a feature's coefficients into a position: p = (I_3 (x) b^T) x.
//
//   b = [1, cos phi .. cos H phi, -sin phi .. -sin H phi, (cos psi .. , -sin psi ..)]
//
// phi is the cardiac phase, psi the respiratory one, both in rad and 2 pi a cycle; the respiratory series is additive.
// The sign of the sines makes (a_k, b_k) the real and imaginary part of the FFT bin F_k = N/2 (a_k + i b_k) of Tully,
// Kantor & Choset (2013).
#pragma once

#include <Eigen/Core>

namespace perimap {

inline constexpr int kMaxHarmonics = 12;            // cardiac
inline constexpr int kMaxRespiratoryHarmonics = 2;  // respiratory
inline constexpr int kMaxBasis = 1 + 2 * (kMaxHarmonics + kMaxRespiratoryHarmonics);
inline constexpr int kMaxState = 3 * kMaxBasis;

// How many harmonics of each kind. 0 <= cardiac_harmonics <= kMaxHarmonics, 0 <= respiratory_harmonics <=
// kMaxRespiratoryHarmonics; whoever reads them from outside must check.
struct BasisLayout {
  int cardiac_harmonics = 8;
  int respiratory_harmonics = 0;

  [[nodiscard]] constexpr int size() const noexcept { return 1 + 2 * (cardiac_harmonics + respiratory_harmonics); }
  [[nodiscard]] constexpr int state_size() const noexcept { return 3 * size(); }
  [[nodiscard]] constexpr bool valid() const noexcept {
    return cardiac_harmonics >= 0 && cardiac_harmonics <= kMaxHarmonics && respiratory_harmonics >= 0 &&
           respiratory_harmonics <= kMaxRespiratoryHarmonics;
  }
  [[nodiscard]] constexpr bool operator==(const BasisLayout&) const noexcept = default;
};

using Basis = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxBasis, 1>;

// b at the two phases (rad, any multiple of 2 pi added); layout.size() long.
[[nodiscard]] Basis basis_at(const BasisLayout& layout, double cardiac_phase_rad,
                             double respiratory_phase_rad = 0.0) noexcept;

// The same where the respiratory phase is not known: its part is zero, so that nothing is said or learnt of it.
[[nodiscard]] Basis basis_without_breath(const BasisLayout& layout, double cardiac_phase_rad) noexcept;

// db/dphi (1/rad), phi the cardiac phase; zero for the respiratory part.
[[nodiscard]] Basis basis_rate(const BasisLayout& layout, double cardiac_phase_rad) noexcept;
// db/dpsi (1/rad), psi the respiratory phase; zero for the rest.
[[nodiscard]] Basis breath_rate(const BasisLayout& layout, double respiratory_phase_rad) noexcept;

}  // namespace perimap
