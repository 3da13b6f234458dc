// Positions as a function of the phases of heart and breathing: a Fourier series in each and their lowest products.
//
//   x(phi, psi) = c + sum_k a_k cos k phi + b_k sin k phi + sum_k c_k cos k psi + d_k sin k psi
//                   + sum_k (cos k phi, sin k phi) x (cos psi, sin psi)
// The products are what breathing does to the beat (Bachta et al., IEEE T-RO 25(5), 2009; Duindam & Sastry, CDC 2007).
#pragma once

#include <Eigen/Core>

namespace perimap {

struct TwoPhaseMapSettings {
  int cardiac_harmonics = 5;
  int respiratory_harmonics = 3;
  int product_harmonics = 1;
  double ridge = 1.0;  // samples' worth of evidence that a first harmonic is zero; k^2 times as much for harmonic k
  double product_ridge = 10.0;
  double memory_s = 30.0;  // older samples count less by a factor of e for each
};

// rad, not wrapped, and rad/s; one value a sample.
struct PhaseTracks {
  Eigen::VectorXd cardiac;
  Eigen::VectorXd cardiac_rate;
  Eigen::VectorXd respiratory;
  Eigen::VectorXd respiratory_rate;
};

class TwoPhaseMap {
 public:
  // By weighted least squares. `samples`: one row a sample; the tracks are at least as long.
  TwoPhaseMap(const TwoPhaseMapSettings& settings, const Eigen::MatrixXd& samples, double period_s,
              const PhaseTracks& phases);

  [[nodiscard]] Eigen::RowVectorXd at(double cardiac, double respiratory) const;
  struct Slopes {
    Eigen::RowVectorXd at;
    Eigen::RowVectorXd along_cardiac;
    Eigen::RowVectorXd along_respiratory;
  };
  [[nodiscard]] Slopes slopes(double cardiac, double respiratory) const;
  // Of what it was fitted to: variance of each channel about it.
  [[nodiscard]] const Eigen::RowVectorXd& variance() const noexcept { return variance_; }

 private:
  // The functions and their derivatives by either phase, a column each.
  [[nodiscard]] Eigen::MatrixX3d basis(double cardiac, double respiratory) const;

  TwoPhaseMapSettings settings_;
  Eigen::MatrixXd coefficients_;  // functions by channels
  Eigen::RowVectorXd variance_;
};

}  // namespace perimap
