// The cost of a batch start and its derivatives, in coordinates that the prior whitens.
//
//   J(y) = |y|^2 + sum_k rho_k,   x_j = x0_j + L_j y_j   for element j of the basis, over the three axes
//
// There the Hessian is I + sum_k w_k B_k^T G_k B_k with G = J^T R^-1 J (3x3): six scalars an observation times b b^T.
// L_j is taken apart into a scale, which goes with the basis, and a shape, whose first element is 1: the shape of a
// prior that is alike on all axes is the identity, and costs nothing.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/estimation/feature_prior.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"
#include "core/estimation/student_t_loss.hpp"

namespace perimap {

enum class Loss : std::uint8_t { kQuadratic, kHuber, kStudentT };

// rho(s) of the squared Mahalanobis residual s, and its derivative, the observation's weight.
struct LossValue {
  double rho;
  double weight;
};

[[nodiscard]] inline LossValue loss_of(Loss loss, double s, double huber_deviations) noexcept {
  switch (loss) {
    case Loss::kQuadratic:
      break;
    case Loss::kHuber: {
      const double radius = std::sqrt(s);
      if (radius <= huber_deviations) break;
      return {huber_deviations * (2.0 * radius - huber_deviations), huber_deviations / radius};
    }
    case Loss::kStudentT:
      return {student_t_loss(s), student_t_weight(s)};
  }
  return {s, 1.0};
}

// Allocates. All arguments of the constructor outlive it.
template <class Model>
class BatchProblem {
 public:
  using Index = Eigen::Index;
  using MatrixXd = Eigen::MatrixXd;
  using VectorXd = Eigen::VectorXd;

  // The prior's x has three times as many elements as each observation's basis.
  BatchProblem(std::span<const Observation> observations, const Model& model, const FeaturePrior& prior,
               double huber_deviations)
      : observations_(observations),
        model_(model),
        prior_(prior),
        huber_deviations_(huber_deviations),
        n_(prior.x.size() / 3),
        scales_(n_),
        scaled_basis_(n_, static_cast<Index>(observations.size())),
        prior_positions_(3, static_cast<Index>(observations.size())),
        R_(observations.size()),
        R_inverse_(observations.size()),
        used_(observations.size(), 1),
        residual2_(observations.size(), 0.0),
        weight_(observations.size(), 0.0) {
    take_apart();
    for (Index k = 0; k < count(); ++k) {
      const Observation& observation = observations_[static_cast<std::size_t>(k)];
      scaled_basis_.col(k) = scales_.cwiseProduct(observation.b);
      prior_positions_.col(k) = position_of(prior.x, observation.b);
      set_covariance(k, observation.R);
    }
    g_.resize(count(), 3);
    G_.resize(count(), 6);
    weighted_basis_.resize(6 * n_, count());
  }

  [[nodiscard]] Index count() const noexcept { return scaled_basis_.cols(); }
  [[nodiscard]] Index dimension() const noexcept { return 3 * n_; }

  // What the phases' deviations make of each observation of the feature that moves as at y comes to its R.
  void widen(const VectorXd& y) {
    shape(y);
    for (Index k = 0; k < count(); ++k) {
      const Observation& observation = observations_[static_cast<std::size_t>(k)];
      if (observation.b_deviation.size() != n_) continue;
      Vector2d z;
      Matrix23d dz_dq;
      const Vector3d p = prior_positions_.col(k) + shaped_.transpose() * scaled_basis_.col(k);
      if (model_.predict(observation.X_CW * p, z, &dz_dq) != ProjectionStatus::kOk) continue;
      const Vector3d displaced = position_of(prior_.x, observation.b_deviation) +
                                 shaped_.transpose() * scales_.cwiseProduct(observation.b_deviation);
      const Vector2d spread = dz_dq * (observation.X_CW.R * displaced);
      set_covariance(k, observation.R + spread * spread.transpose());
    }
  }

  // What each observation counts with, without the variance scale.
  [[nodiscard]] const std::vector<Matrix2d>& R() const noexcept { return R_; }
  // Every R times this; 1 at first.
  void set_variance_scale(double scale) noexcept { variance_scale_ = scale; }
  // Which observations count, 1 or 0; the caller decides.
  [[nodiscard]] std::vector<std::uint8_t>& used() noexcept { return used_; }
  // At the y last evaluated:
  [[nodiscard]] const std::vector<double>& residual2() const noexcept { return residual2_; }
  [[nodiscard]] const std::vector<double>& weight() const noexcept { return weight_; }
  [[nodiscard]] int visible() const noexcept { return visible_; }

  // J(y); leaves residuals, weights and, for normal_equations(), the first derivatives at y.
  double evaluate(const VectorXd& y, Loss loss) {
    double cost = y.squaredNorm();
    shape(y);
    visible_ = 0;
    for (Index k = 0; k < count(); ++k) {
      const auto index = static_cast<std::size_t>(k);
      const Observation& observation = observations_[index];
      const Vector3d p = prior_positions_.col(k) + shaped_.transpose() * scaled_basis_.col(k);
      Vector2d z;
      Matrix23d dz_dq;
      const bool seen = model_.predict(observation.X_CW * p, z, &dz_dq) == ProjectionStatus::kOk;
      visible_ += seen ? 1 : 0;
      double s = kInvisible;
      Vector2d Wr = Vector2d::Zero();
      if (seen) {
        const Vector2d r = model_.residual(observation.z, z);
        Wr = R_inverse_[index] * r;
        s = r.dot(Wr);
      }
      residual2_[index] = s;
      if (used_[index] == 0) {
        g_.row(k).setZero();
        G_.row(k).setZero();
        continue;
      }
      const LossValue value = loss_of(loss, s / variance_scale_, huber_deviations_);
      cost += value.rho;
      weight_[index] = value.weight / variance_scale_;
      if (!seen) {
        g_.row(k).setZero();
        G_.row(k).setZero();
        continue;
      }
      const Matrix23d J = dz_dq * observation.X_CW.R;
      const Matrix23d WJ = weight_[index] * (R_inverse_[index] * J);
      const Matrix3d G = J.transpose() * WJ;
      g_.row(k) = weight_[index] * (J.transpose() * Wr).transpose();
      G_.row(k) << G(0, 0), G(1, 0), G(2, 0), G(1, 1), G(2, 1), G(2, 2);
    }
    return cost;
  }

  // Half the Hessian (Gauss-Newton, lower triangle) and minus half the gradient at the y last evaluated.
  void normal_equations(const VectorXd& y, MatrixXd& A, VectorXd& descent) {
    // The six n x n blocks by one matrix product.
    for (Index block = 0; block < 6; ++block) {
      weighted_basis_.middleRows(block * n_, n_).noalias() = scaled_basis_ * G_.col(block).asDiagonal();
    }
    blocks_.noalias() = weighted_basis_ * scaled_basis_.transpose();
    A.setZero(dimension(), dimension());
    descent = -y;
    for (Index column = 0; column < 3; ++column) {
      for (Index q = column; q < 3; ++q) {
        if (!has_shape(q, column)) continue;
        descent.segment(column * n_, n_) += shape_at(q, column).cwiseProduct(scaled_basis_ * g_.col(q));
        for (Index row = column; row < 3; ++row) {
          for (Index p = row; p < 3; ++p) {
            if (!has_shape(p, row)) continue;
            A.block(row * n_, column * n_, n_, n_) +=
                shape_at(p, row).asDiagonal() * block_of(p, q) * shape_at(q, column).asDiagonal();
          }
        }
      }
    }
    A.diagonal().array() += 1.0;
  }

  // x at y.
  [[nodiscard]] StateVector state_at(const VectorXd& y) {
    shape(y);
    StateVector x = prior_.x;
    for (Index axis = 0; axis < 3; ++axis) x.segment(axis * n_, n_) += scales_.cwiseProduct(shaped_.col(axis));
    return x;
  }

  // The covariance of x where that of y is P, symmetric bit by bit.
  [[nodiscard]] StateMatrix covariance_of_state(MatrixXd P) const {
    // Rows, then columns; from the last axis on, since a shape is lower triangular.
    for (int side = 0; side < 2; ++side) {
      for (Index a = 2; a >= 0; --a) {
        P.middleRows(a * n_, n_) = (shape_at(a, a).asDiagonal() * P.middleRows(a * n_, n_)).eval();
        for (Index c = 0; c < a; ++c) {
          if (has_shape(a, c)) P.middleRows(a * n_, n_) += shape_at(a, c).asDiagonal() * P.middleRows(c * n_, n_);
        }
      }
      P.transposeInPlace();
    }
    const Index d = dimension();
    StateMatrix covariance(d, d);
    for (Index j = 0; j < d; ++j) {
      for (Index i = j; i < d; ++i) {
        covariance(i, j) = covariance(j, i) = 0.5 * (P(i, j) + P(j, i)) * scales_(i % n_) * scales_(j % n_);
      }
    }
    return covariance;
  }

 private:
  // A squared residual stands in for an observation in which the feature can't be seen from where it is supposed to be:
  // a thousand deviations, without a gradient. So a start on the wrong side of one camera is bad but not lost.
  static constexpr double kInvisible = 1e6;

  void take_apart() {
    shapes_.resize(n_, 9);
    for (Index j = 0; j < n_; ++j) {
      const Matrix3d& L = prior_.factors_mm[static_cast<std::size_t>(j)];
      scales_(j) = L(0, 0);
      const Matrix3d F = L / L(0, 0);
      shapes_.row(j) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(F.data());
    }
    for (Index i = 0; i < 9; ++i) has_shape_[static_cast<std::size_t>(i)] = !(shapes_.col(i).array() == 0.0).all();
  }
  [[nodiscard]] auto shape_at(Index row, Index column) const { return shapes_.col(3 * column + row); }
  [[nodiscard]] bool has_shape(Index row, Index column) const {
    return has_shape_[static_cast<std::size_t>(3 * column + row)];
  }
  // G is symmetric, and so is each block.
  [[nodiscard]] auto block_of(Index p, Index q) const {
    constexpr Index kBlocks[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    return blocks_.middleRows(kBlocks[p][q] * n_, n_);
  }

  // shaped_ = what y adds to the elements, in units of their scales.
  void shape(const VectorXd& y) {
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> of_axis(y.data(), n_, 3);
    shaped_.setZero(n_, 3);
    for (Index row = 0; row < 3; ++row) {
      for (Index column = 0; column <= row; ++column) {
        if (has_shape(row, column)) shaped_.col(row) += shape_at(row, column).cwiseProduct(of_axis.col(column));
      }
    }
  }

  void set_covariance(Index k, const Matrix2d& R) {
    const auto index = static_cast<std::size_t>(k);
    R_[index] = R;
    R_inverse_[index] = R.inverse();
  }

  std::span<const Observation> observations_;
  const Model& model_;
  const FeaturePrior& prior_;
  double huber_deviations_;
  Index n_;
  Basis scales_;                                     // n, mm
  Eigen::Matrix<double, Eigen::Dynamic, 9> shapes_;  // n x 9: of each element, column by column
  std::array<bool, 9> has_shape_{};                  // whether that column is not zero for all elements
  MatrixXd scaled_basis_;                            // n x K: scale o b of each observation
  Eigen::Matrix3Xd prior_positions_;                 // 3 x K, at y = 0
  Eigen::Matrix<double, Eigen::Dynamic, 3> shaped_;
  std::vector<Matrix2d> R_;
  std::vector<Matrix2d> R_inverse_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> g_;  // J^T R^-1 r w
  Eigen::Matrix<double, Eigen::Dynamic, 6> G_;  // xx, yx, zx, yy, zy, zz of J^T R^-1 J w
  MatrixXd weighted_basis_;
  MatrixXd blocks_;
  double variance_scale_ = 1.0;
  std::vector<std::uint8_t> used_;
  std::vector<double> residual2_;
  std::vector<double> weight_;
  int visible_ = 0;
};

}  // namespace perimap
