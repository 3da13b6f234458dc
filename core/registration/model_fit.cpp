#include "core/registration/model_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/geometry/nearest_triangle.hpp"
#include "core/registration/residual_covariance.hpp"
#include "core/surface/six_elements.hpp"

namespace perimap {
namespace {

constexpr Eigen::Index kMostPoints = 400;  // more of them tell no more: their errors are their neighbours'
constexpr Eigen::Index kFewestPoints = 30;
constexpr double kFewestMet = 0.5;  // share of the points
constexpr double kMostTurned = 0.3;
constexpr int kMostSteps = 50;
constexpr double kFarthest = 22.5;     // squared deviations between the two fits
constexpr int kMostHalvings = 6;       // of a step that makes nothing better
constexpr double kSettled_rad = 1e-4;  // a hundredth of a millimetre at an organ's size
constexpr double kSettled_mm = 1e-2;
constexpr double kOutlier = 3.0;  // deviations from which on a residual has less weight
// Of the misfit's distribution, in deviations of a normal one.
constexpr double kDoubt = 2.3;
constexpr double kRefusal = 4.0;
// And what is left unexplained has to be as large as that: of the surface's own deviations not more is known.
constexpr double kDoubt_mm = 0.3;
constexpr double kRefusal_mm = 0.5;
constexpr double kStartDoubt = 22.5;  // squared deviations from the start: one in a thousand, of six
constexpr double kUntold = 0.5;       // share of the start's variance that is left

template <class... Numbers>
std::string text(const char* format, Numbers... numbers) {
  std::array<char, 256> line{};
  (void)std::snprintf(line.data(), line.size(), format, numbers...);
  return line.data();
}

Matrix3d symmetric_root(const Eigen::Matrix<double, 6, 1>& c) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(from_six(c));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

// (rotation, translation) in I by which `X_IW` differs from `from_X_IW`, about a point of I.
Vector6d offset(const Pose& X_IW, const Pose& from_X_IW, const Vector3d& about_I) {
  const Pose moved = X_IW * from_X_IW.inverse();
  Vector6d d;
  d << so3_log(moved.R), moved * about_I - about_I;
  return d;
}

Pose moved_by(const Vector6d& d, const Vector3d& about_I, const Pose& X_IW) {
  const Matrix3d R = so3_exp(d.head<3>());
  return Pose{R, about_I + d.tail<3>() - R * about_I} * X_IW;
}

// What a point at p does when (rotation, translation) about `about_I` changes.
Eigen::Matrix<double, 3, 6> motion_at(const Vector3d& p_I, const Vector3d& about_I) {
  Eigen::Matrix<double, 3, 6> J;
  J << -cross_matrix(p_I - about_I), Matrix3d::Identity();
  return J;
}

Matrix6d about_another(const Matrix6d& covariance, const Vector3d& from_I, const Vector3d& to_I) {
  Matrix6d A = Matrix6d::Identity();
  A.bottomRows<3>() = motion_at(to_I, from_I);
  return A * covariance * A.transpose();
}

double rms(const Eigen::VectorXd& values) {
  return values.size() > 0 ? std::sqrt(values.squaredNorm() / static_cast<double>(values.size())) : 0.0;
}

class Fitter {
 public:
  Fitter(const TriangleMesh& model, const SurfacePoints& surface, const RigidEstimate& start, const ModelErrors& errors)
      : nearest_(model), errors_(errors), start_(start), X_IW_(start.X_IW) {
    // Spread over all: a mesh's vertices come row by row.
    const Eigen::Index all = surface.size();
    const Eigen::Index N = std::min(all, kMostPoints);
    for (Eigen::Index i = 0; i < N; ++i) {
      const Eigen::Index v = i * all / N;
      chosen_.push_back(v);
      roots_W_.push_back(symmetric_root(surface.covariances_W_mm2.col(v)));
    }
    surface_ = &surface;
    middle_W_ = surface.positions_W_mm.rowwise().mean();
  }

  Expected<ModelFit> run() {
    ModelFit fit;
    meet(fit);
    if (auto wrong = refuse_meeting(fit)) return tl::unexpected(*std::move(wrong));
    fit.start_residual_mm = rms(met_.residuals_mm);
    const Vector3d start_middle_I = start_.X_IW * middle_W_;
    const Matrix6d start_covariance = about_another(start_.covariance, start_.middle_I, start_middle_I);
    const Eigen::LDLT<Matrix6d> start_ldlt(start_covariance);
    if (!start_covariance.allFinite() || start_ldlt.info() != Eigen::Success || !start_ldlt.isPositive() ||
        !(start_ldlt.vectorD().minCoeff() > 0.0)) {
      return fail("the start's covariance is none: it has to be positive definite");
    }
    const Matrix6d prior = start_ldlt.solve(Matrix6d::Identity());
    auto settled = descend(fit, prior, start_middle_I);
    if (!settled) return tl::unexpected(settled.error());
    // Then with all of the covariance, by which details tell as well. Where that leads further away than the first fit
    // may be off, it is a minimum of its own, and the first one holds.
    const Pose first_X_IW = X_IW_;
    const Matrix6d first_covariance = covariance_;
    whole_ = true;
    settled = descend(fit, prior, start_middle_I);
    const Vector6d apart = offset(X_IW_, first_X_IW, first_X_IW * middle_W_);
    if (!settled || !(apart.dot(first_covariance.ldlt().solve(apart)) < kFarthest)) {
      whole_ = false;
      X_IW_ = first_X_IW;
      settled = descend(fit, prior, start_middle_I);
      if (!settled) return tl::unexpected(settled.error());
    }
    return judge(std::move(fit), start_covariance, start_middle_I, *settled);
  }

 private:
  // Which points meet the model where it is now.
  void meet(ModelFit& fit) {
    fit.beyond_edge = fit.turned_away = 0;
    std::vector<std::pair<std::size_t, NearestPlace>> met;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const Vector3d p_I = X_IW_ * surface_->positions_W_mm.col(chosen_[i]);
      const NearestPlace place = nearest_.to(p_I);
      if (place.on_border) {
        ++fit.beyond_edge;
      } else if (place.normal.dot(X_IW_.R * surface_->normals_W.col(chosen_[i])) <= 0.0) {
        ++fit.turned_away;
      } else {
        met.emplace_back(i, place);
      }
    }
    const auto N = static_cast<Eigen::Index>(met.size());
    met_index_.clear();
    met_ = {Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd(3, N), Eigen::Matrix3Xd(3, N),
            Eigen::VectorXd(N),     Eigen::Matrix3Xd(3, N), Eigen::VectorXd(N)};
    for (Eigen::Index k = 0; k < N; ++k) {
      const auto& [i, place] = met[static_cast<std::size_t>(k)];
      met_index_.push_back(i);
      const Vector3d p_I = X_IW_ * surface_->positions_W_mm.col(chosen_[i]);
      met_.positions_I_mm.col(k) = p_I;
      met_.places_I_mm.col(k) = place.point;
      met_.normals_I.col(k) = place.normal;
      met_.residuals_mm(k) = place.normal.dot(p_I - place.point);
      const Vector3d n_W = X_IW_.R.transpose() * place.normal;
      met_.spreads.col(k) = roots_W_[i] * n_W;
      met_.rates_mm_per_rad(k) = n_W.dot(surface_->rates_W_mm_per_rad.col(chosen_[i]));
    }
    fit.points = met.size();
  }

  [[nodiscard]] std::optional<Error> refuse_meeting(const ModelFit& fit) const {
    const std::size_t all = chosen_.size();
    if (static_cast<double>(fit.turned_away) > kMostTurned * static_cast<double>(all)) {
      return Error{
          text("at %zu of %zu points of the surface the model faces the other way: it is mirrored or inside "
               "out, or the start is so far off that its far side is nearest",
               fit.turned_away, all)};
    }
    if (met_.size() < kFewestPoints || static_cast<double>(fit.points) < kFewestMet * static_cast<double>(all)) {
      return Error{
          text("only %zu of %zu points of the surface meet the model, %zu lie beyond its edges: it ends there, "
               "or the start is far off",
               fit.points, all, fit.beyond_edge)};
    }
    return std::nullopt;
  }

  [[nodiscard]] Eigen::MatrixXd jacobian() const {
    const Vector3d middle_I = X_IW_ * middle_W_;
    Eigen::MatrixXd J(met_.size(), 6);
    for (Eigen::Index k = 0; k < met_.size(); ++k) {
      J.row(k) = met_.normals_I.col(k).transpose() * motion_at(met_.positions_I_mm.col(k), middle_I);
    }
    return J;
  }

  // By what an outlier's variance is enlarged. While the pose is off all residuals are large, and none is one.
  [[nodiscard]] Eigen::VectorXd enlarged(const Eigen::MatrixXd& C) const {
    const Eigen::ArrayXd deviations = C.diagonal().array().sqrt();
    const Eigen::ArrayXd ratios = met_.residuals_mm.array().abs() / deviations;
    std::vector<double> sorted(ratios.data(), ratios.data() + ratios.size());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double scale = std::max(1.0, 1.4826 * *middle);
    const Eigen::ArrayXd beyond = (ratios / (kOutlier * scale)).max(1.0);
    return (C.diagonal().array() * (beyond.square() - 1.0)).matrix();
  }

  // Steps until one is short: whether that came to pass. Residuals, covariance and weights are those of where it ended.
  Expected<bool> descend(ModelFit& fit, const Matrix6d& prior, const Vector3d& start_middle_I) {
    bool settled = false;
    for (int step = 0;; ++step) {
      meet(fit);
      if (auto wrong = refuse_meeting(fit)) return tl::unexpected(*std::move(wrong));
      const auto d = improve(prior, start_middle_I);
      if (!d) return fail("the errors declared leave no fit: they have to be positive numbers");
      if (settled || step == kMostSteps) return settled;
      settled = !take(*d, prior, start_middle_I);
    }
  }

  // The residuals' weights times x: of the inverse covariance, or each by its own variance.
  [[nodiscard]] Eigen::MatrixXd weighed(const Eigen::MatrixXd& x) const {
    if (whole_) return whole_covariance_.solve(x);
    return weights_.asDiagonal() * x;
  }

  // What is minimised, at another pose by the same points with the same covariance; nearest places are sought anew.
  [[nodiscard]] double cost_at(const Pose& X_IW, const Matrix6d& prior, const Vector3d& start_middle_I) const {
    Eigen::VectorXd residuals_mm(met_.size());
    for (Eigen::Index k = 0; k < met_.size(); ++k) {
      const std::size_t i = met_index_[static_cast<std::size_t>(k)];
      const Vector3d p_I = X_IW * surface_->positions_W_mm.col(chosen_[i]);
      const NearestPlace place = nearest_.to(p_I);
      residuals_mm(k) = place.normal.dot(p_I - place.point);
    }
    const Vector6d d = offset(X_IW, start_.X_IW, start_middle_I);
    return residuals_mm.dot(weighed(residuals_mm).col(0)) + d.dot(prior * d);
  }

  // Takes the step as far as it makes things better; false when it is so short that the fit has settled.
  bool take(Vector6d d, const Matrix6d& prior, const Vector3d& start_middle_I) {
    for (int halved = 0; halved <= kMostHalvings; ++halved, d *= 0.5) {
      const Pose X_IW = moved_by(d, X_IW_ * middle_W_, X_IW_);
      if (!(cost_at(X_IW, prior, start_middle_I) < cost_)) continue;
      X_IW_ = X_IW;
      return d.head<3>().norm() > kSettled_rad || d.tail<3>().norm() > kSettled_mm;
    }
    return false;
  }

  // The step of Gauss-Newton, and cost and covariance where it begins; none where the numbers are none.
  std::optional<Vector6d> improve(const Matrix6d& prior, const Vector3d& start_middle_I) {
    C_ = residual_covariance(met_, errors_);
    if (!C_.allFinite() || !(C_.diagonal().minCoeff() > 0.0)) return std::nullopt;
    const Eigen::VectorXd variances = C_.diagonal() + enlarged(C_);
    if (whole_) {
      Eigen::MatrixXd enlarged_C = C_;
      enlarged_C.diagonal() = variances;
      whole_covariance_.compute(enlarged_C);
      if (whole_covariance_.info() != Eigen::Success) return std::nullopt;
    } else {
      // Residuals that err together tell together what so many independent ones would: as much they weigh beside the
      // start.
      const Eigen::VectorXd roots = C_.diagonal().cwiseInverse().cwiseSqrt();
      const double N = static_cast<double>(met_.size());
      const double share = N / (roots.asDiagonal() * C_ * roots.asDiagonal()).squaredNorm();
      weights_ = share * variances.cwiseInverse();
    }
    J_ = jacobian();
    const Vector6d from_start = offset(X_IW_, start_.X_IW, start_middle_I);
    const Eigen::MatrixXd JtW = weighed(J_).transpose();
    const Vector6d gradient = JtW * met_.residuals_mm + prior * from_start;
    cost_ = met_.residuals_mm.dot(weighed(met_.residuals_mm).col(0)) + from_start.dot(prior * from_start);
    const Matrix6d information = JtW * J_ + prior;
    const Matrix6d gain = information.ldlt().solve(Matrix6d::Identity());
    K_ = gain * JtW;
    // What errors of residuals and of the start make of the pose, whatever the weights are (the sandwich formula).
    covariance_ = K_ * C_ * K_.transpose() + gain * prior * gain;
    const Vector6d d = -gain * gradient;
    if (!d.allFinite() || !covariance_.allFinite()) return std::nullopt;
    return d;
  }

  // Residuals beside what their covariance after the fit makes of them.
  struct Misfit {
    double ratio = 1.0;       // of the sum of squares, each by its own variance, to its expectation
    double deviations = 0.0;  // by how many of a normal distribution that is too much
    double excess_mm = 0.0;   // RMS of what is not explained
  };
  [[nodiscard]] Misfit misfit(const Eigen::MatrixXd& after, const Eigen::VectorXd& residuals_mm) const {
    // Sums of dependent squares scatter as chi squares of so many degrees of freedom that mean and variance are theirs
    // (Satterthwaite, Biometrics Bulletin 2(6), 1946).
    const Eigen::VectorXd roots = C_.diagonal().cwiseInverse().cwiseSqrt();
    const Eigen::MatrixXd weighed = roots.asDiagonal() * after * roots.asDiagonal();
    const double expected = weighed.trace();
    const double freedom = expected * expected / weighed.squaredNorm();
    Misfit misfit;
    misfit.ratio = roots.cwiseProduct(residuals_mm).squaredNorm() / expected;
    // Wilson & Hilferty 1931: the cube root of a chi square is nearly normal.
    const double spread = 2.0 / (9.0 * freedom);
    misfit.deviations = (std::cbrt(misfit.ratio) - (1.0 - spread)) / std::sqrt(spread);
    misfit.excess_mm = std::sqrt(
        std::max(0.0, (residuals_mm.squaredNorm() - after.trace()) / static_cast<double>(residuals_mm.size())));
    return misfit;
  }

  Expected<ModelFit> judge(ModelFit fit, const Matrix6d& start_covariance, const Vector3d& start_middle_I,
                           bool settled) const {
    const Eigen::MatrixXd told = J_ * (K_ * C_);
    const Eigen::MatrixXd after = C_ - told - told.transpose() + J_ * covariance_ * J_.transpose();
    // Of outliers that much counts that has weight: a few are an instrument, and no other shape.
    const Eigen::VectorXd weights = C_.diagonal().cwiseQuotient(C_.diagonal() + enlarged(C_));
    const Misfit of_most = misfit(after, weights.cwiseSqrt().cwiseProduct(met_.residuals_mm));
    const Misfit of_all = misfit(after, met_.residuals_mm);
    fit.residual_mm = rms(met_.residuals_mm);
    fit.expected_residual_mm = std::sqrt(std::max(0.0, after.diagonal().mean()));
    fit.estimate.X_IW = X_IW_;
    fit.estimate.middle_I = X_IW_ * middle_W_;
    // What is left over beyond what was declared is an error as well.
    fit.estimate.covariance = covariance_ * std::max(1.0, of_most.ratio);
    if (!fit.estimate.X_IW.t.allFinite() || !fit.estimate.covariance.allFinite()) return fail("the fit has no number");
    measure_motion(fit);
    const std::string residual = text(
                                     "%.2f mm RMS are left between surface and model, and %.2f mm are explained by "
                                     "the errors declared",
                                     fit.residual_mm, fit.expected_residual_mm) +
                                 where_worst();
    if (of_most.deviations > kRefusal && of_most.excess_mm > kRefusal_mm) return fail("another shape: " + residual);
    if (of_all.deviations > kDoubt && of_all.excess_mm > kDoubt_mm) fit.doubts.push_back(residual);
    if (!settled) fit.doubts.emplace_back("the fit did not settle: another start may lead elsewhere");
    judge_start(fit, start_covariance, start_middle_I);
    return fit;
  }

  void measure_motion(ModelFit& fit) const {
    double moved = 0.0, variance = 0.0;
    for (Eigen::Index k = 0; k < met_.size(); ++k) {
      const Vector3d p_I = met_.positions_I_mm.col(k);
      moved += (p_I - start_.X_IW * (X_IW_.inverse() * p_I)).squaredNorm();
      const Eigen::Matrix<double, 3, 6> J = motion_at(p_I, fit.estimate.middle_I);
      variance += (J * fit.estimate.covariance * J.transpose()).trace();
    }
    const auto N = static_cast<double>(met_.size());
    fit.moved_mm = std::sqrt(moved / N);
    fit.organ_deviation_mm = std::sqrt(variance / N);
    fit.moved_rad = so3_log(X_IW_.R * start_.X_IW.R.transpose()).norm();
  }

  // How far from the start, by its deviations, and what is not better known than at the start.
  void judge_start(ModelFit& fit, const Matrix6d& start_covariance, const Vector3d& start_middle_I) const {
    const Vector6d d = offset(X_IW_, start_.X_IW, start_middle_I);
    const double far = d.dot(start_covariance.ldlt().solve(d));
    if (far > kStartDoubt) {
      fit.doubts.push_back(
          text("it was moved by %.1f mm and %.1f degrees, %.1f deviations of the start in all: the "
               "landmarks, or the model, are others",
               fit.moved_mm, fit.moved_rad / kDegree, std::sqrt(far)));
    }
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> shares(covariance_, start_covariance);
    if (shares.info() != Eigen::Success) return;
    fit.told_by_start = static_cast<int>((shares.eigenvalues().array() > kUntold).count());
  }

  [[nodiscard]] std::string where_worst() const {
    Eigen::Index worst = 0;
    met_.residuals_mm.cwiseAbs().maxCoeff(&worst);
    const Vector3d p = met_.places_I_mm.col(worst);
    return text("; %.1f mm at (%.0f, %.0f, %.0f) mm of the model", met_.residuals_mm(worst), p.x(), p.y(), p.z());
  }

  NearestTriangle nearest_;
  const SurfacePoints* surface_ = nullptr;
  ModelErrors errors_;
  RigidEstimate start_;
  Pose X_IW_;
  Vector3d middle_W_ = Vector3d::Zero();
  std::vector<Eigen::Index> chosen_;
  std::vector<Matrix3d> roots_W_;
  MetPoints met_;
  std::vector<std::size_t> met_index_;            // into chosen_
  Eigen::MatrixXd C_, J_, K_;                     // K_: what residuals make of the pose
  bool whole_ = false;                            // weighed by all of the covariance
  Eigen::VectorXd weights_;                       // where not
  Eigen::LLT<Eigen::MatrixXd> whole_covariance_;  // of residuals, with outliers' variances enlarged
  double cost_ = 0.0;
  Matrix6d covariance_ = Matrix6d::Zero();
};

}  // namespace

Expected<ModelFit> fit_model(const TriangleMesh& model, const SurfacePoints& surface, const RigidEstimate& start,
                             const ModelErrors& errors) {
  if (surface.size() < kFewestPoints) {
    return fail(
        text("the surface has %td points away from its edge, and %td are needed", surface.size(), kFewestPoints));
  }
  return Fitter(model, surface, start, errors).run();
}

RegistrationDifference difference_at(const RigidEstimate& first, const Pose& second_X_IW,
                                     const Eigen::Matrix3Xd& positions_W_mm) {
  RegistrationDifference difference;
  double squares = 0.0;
  for (Eigen::Index i = 0; i < positions_W_mm.cols(); ++i) {
    const Vector3d p_W = positions_W_mm.col(i);
    const double apart = (first.X_IW * p_W - second_X_IW * p_W).norm();
    squares += apart * apart;
    difference.largest_mm = std::max(difference.largest_mm, apart);
  }
  difference.rms_mm = std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(1, positions_W_mm.cols())));
  const Vector6d d = offset(second_X_IW, first.X_IW, first.middle_I);
  difference.nees = d.dot(first.covariance.ldlt().solve(d)) / 6.0;
  return difference;
}

}  // namespace perimap
