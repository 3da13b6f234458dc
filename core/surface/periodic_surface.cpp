#include "core/surface/periodic_surface.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/surface/six_elements.hpp"

namespace perimap {
namespace {

constexpr int kLowHarmonics = 2;
// Places at once, so that their matrices stay in the processor's cache.
constexpr std::size_t kBlock = 128;

tl::unexpected<SurfaceRefusal> refuse(SurfaceRefusalKind kind, std::string message) {
  return tl::unexpected(SurfaceRefusal{kind, std::move(message)});
}

Vector3d coefficients_of(const SurfaceEvidence& evidence, const BasisLayout& layout, int element) {
  const int n = layout.size();
  return {evidence.x(element), evidence.x(n + element), evidence.x(2 * n + element)};
}

std::string of_feature(std::uint32_t id) { return "feature " + std::to_string(id); }

}  // namespace

std::pair<int, int> bands_of(const BasisLayout& layout, HarmonicGroup group) noexcept {
  const int cardiac = layout.cardiac_harmonics;
  switch (group) {
    case HarmonicGroup::kLow:
      return {0, std::min(kLowHarmonics, cardiac)};
    case HarmonicGroup::kHigh:
      return {std::min(kLowHarmonics, cardiac), cardiac};
    case HarmonicGroup::kBreath:
      break;
  }
  return {cardiac, bands(layout)};
}

tl::expected<PeriodicSurface, SurfaceRefusal> PeriodicSurface::fit(const BasisLayout& layout,
                                                                   std::span<const SurfaceEvidence> evidence,
                                                                   const Vector3d& camera_W,
                                                                   const SurfaceSettings& settings,
                                                                   const SurfaceKernels& kernels, KernelSearch search,
                                                                   std::shared_ptr<const ModelMotion> model) {
  PeriodicSurface surface;
  surface.layout_ = layout;
  surface.settings_ = settings;
  surface.kernels_ = kernels;
  surface.model_ = std::move(model);
  surface.evidence_.assign(evidence.begin(), evidence.end());
  // What contradicts the others is left out, and they are asked again: it may have hidden a second one.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (auto fitted = surface.fit_to_evidence(camera_W, search); !fitted) {
      return tl::unexpected(std::move(fitted.error()));
    }
    if (!surface.leave_out_contradicted()) break;
    if (search == KernelSearch::kAnew) search = KernelSearch::kNearby;
  }
  return surface;
}

tl::expected<void, SurfaceRefusal> PeriodicSurface::fit_to_evidence(const Vector3d& camera_W, KernelSearch search) {
  if (auto placed = place_features(camera_W); !placed) return placed;
  depth_ = DepthField::fit(chart_, places_, kernels_.depth, search);
  if (!depth_) return refuse(SurfaceRefusalKind::kNoKernel, "the depths of the features fit no smooth surface");
  kernels_.depth = depth_->kernel();
  const Eigen::ArrayXXd r_mm = distances(p_W_mm_, p_W_mm_);
  const OwnHarmonics own_W_mm = own_at_features();
  for (const HarmonicGroup group : kEveryHarmonicGroup) {
    const auto [first, end] = bands_of(layout_, group);
    if (first == end) continue;
    const auto g = static_cast<std::size_t>(group);
    motion_[g] = MotionField::fit(charted_motion(group, own_W_mm), r_mm, kernels_.motion[g], search);
    if (!motion_[g]) return refuse(SurfaceRefusalKind::kNoKernel, "the motions of the features fit no smooth surface");
    kernels_.motion[g] = motion_[g]->kernels();
  }
  return {};
}

tl::expected<void, SurfaceRefusal> PeriodicSurface::place_features(const Vector3d& camera_W) {
  const std::size_t N = evidence_.size();
  if (N < settings_.fewest_features) {
    return refuse(SurfaceRefusalKind::kTooFewFeatures,
                  std::to_string(N) + " features, a surface needs " + std::to_string(settings_.fewest_features));
  }
  if (!camera_W.allFinite()) return refuse(SurfaceRefusalKind::kNotANumber, "the camera's place is not a number");
  p_W_mm_.resize(3, static_cast<Eigen::Index>(N));
  for (std::size_t i = 0; i < N; ++i) {
    if (!is_usable(evidence_[i], layout_)) {
      return refuse(SurfaceRefusalKind::kNotANumber,
                    of_feature(evidence_[i].id) + " has a coefficient or a variance that is not a number, or too few");
    }
    p_W_mm_.col(static_cast<Eigen::Index>(i)) = coefficients_of(evidence_[i], layout_, 0);
  }
  const Vector3d centre_W = p_W_mm_.rowwise().mean();
  if (!((centre_W - camera_W).norm() > 1.0)) {
    return refuse(SurfaceRefusalKind::kBehindCamera, "the camera is in the middle of the features");
  }
  chart_ = SurfaceChart::looking_at(camera_W, centre_W);
  places_.s_mm.resize(2, static_cast<Eigen::Index>(N));
  places_.depth_mm.resize(static_cast<Eigen::Index>(N));
  places_.covariances_A_mm2.clear();
  std::vector<Vector2d> charted;
  for (std::size_t i = 0; i < N; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const SurfaceChart::Place place = chart_.place_of(p_W_mm_.col(column));
    if (!(place.depth_mm > 0.0)) {
      return refuse(SurfaceRefusalKind::kBehindCamera, of_feature(evidence_[i].id) + " lies behind the mean camera");
    }
    places_.s_mm.col(column) = place.s;
    places_.depth_mm(column) = place.depth_mm;
    places_.covariances_A_mm2.emplace_back(chart_.X_WA.R.transpose() * evidence_[i].mean_mm2 * chart_.X_WA.R);
    charted.push_back(place.s);
  }
  const Eigen::Matrix2Xd about = places_.s_mm.colwise() - places_.s_mm.rowwise().mean();
  const Matrix2d scatter = about * about.transpose() / static_cast<double>(N);
  const Vector2d spread2 = Eigen::SelfAdjointEigenSolver<Matrix2d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kNarrowest = 0.05;  // of the wider deviation
  if (!(spread2(0) > kNarrowest * kNarrowest * spread2(1)) || !(spread2(1) > 1e-6)) {
    return refuse(SurfaceRefusalKind::kOnALine, "the " + std::to_string(N) +
                                                    " features lie on a line as the camera sees them: they spread by " +
                                                    std::to_string(std::sqrt(std::max(0.0, spread2(1)))) + " mm and " +
                                                    std::to_string(std::sqrt(std::max(0.0, spread2(0)))) + " mm");
  }
  support_.emplace(std::move(charted));
  return {};
}

// The model is registered at its own phase, and there the places are compared with it.
OwnHarmonics PeriodicSurface::own_at(const Eigen::Matrix3Xd& p_W_mm) const {
  if (!model_) return {};
  // Where it is in the mean is some millimetres away, over which its motion hardly changes.
  constexpr int kRounds = 2;
  const Basis b = basis_without_breath(layout_, model_->phase_rad());
  OwnHarmonics own_W_mm = model_->at(p_W_mm);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd coefficients_W_mm = Eigen::MatrixXd::Zero(3 * p_W_mm.cols(), layout_.size());
    for (const HarmonicGroup group : kEveryHarmonicGroup) {
      const auto& motion = motion_[static_cast<std::size_t>(group)];
      if (!motion || motion->gains().empty()) continue;
      put(scaled(charted_model(own_W_mm, group), motion->gains()), group, 0, coefficients_W_mm);
    }
    const Eigen::VectorXd h = coefficients_W_mm * b;
    own_W_mm = model_->at(p_W_mm + Eigen::Map<const Eigen::Matrix3Xd>(h.data(), 3, p_W_mm.cols()));
  }
  return own_W_mm;
}

OwnHarmonics PeriodicSurface::own_at_features() const {
  if (!model_) return {};
  const Basis b = basis_without_breath(layout_, model_->phase_rad());
  Eigen::Matrix3Xd m_W_mm(3, p_W_mm_.cols());
  for (Eigen::Index i = 0; i < m_W_mm.cols(); ++i) {
    m_W_mm.col(i) = position_of(evidence_[static_cast<std::size_t>(i)].x, b);
  }
  return model_->at(m_W_mm);
}

ChartedHarmonics PeriodicSurface::charted_model(const OwnHarmonics& own_W_mm, HarmonicGroup group) const {
  if (!model_) return {};
  const auto [first, end] = bands_of(layout_, group);
  const Eigen::Index V = own_W_mm.rows() / 3;
  const Eigen::Index H = model_->harmonics();
  ChartedHarmonics own;
  own.across_mm.setZero(V, 4 * (end - first));
  own.along_mm.setZero(V, 2 * (end - first));
  const Matrix3d R_AW = chart_.X_WA.R.transpose();
  // It breathes not, and may have fewer harmonics than the features.
  const int most = std::min(layout_.cardiac_harmonics, model_->harmonics());
  for (int band = first; band < std::min(end, most); ++band) {
    for (Eigen::Index v = 0; v < V; ++v) {
      const Vector3d cosine = R_AW * own_W_mm.block<3, 1>(3 * v, band);
      const Vector3d sine = R_AW * own_W_mm.block<3, 1>(3 * v, H + band);
      own.across_mm.row(v).segment<4>(4 * (band - first)) << cosine.x(), cosine.y(), sine.x(), sine.y();
      own.along_mm.row(v).segment<2>(2 * (band - first)) << cosine.z(), sine.z();
    }
  }
  return own;
}

ChartedMotion PeriodicSurface::charted_motion(HarmonicGroup group, const OwnHarmonics& own_W_mm) const {
  const auto [first, end] = bands_of(layout_, group);
  const auto N = static_cast<Eigen::Index>(evidence_.size());
  const Matrix3d R_AW = chart_.X_WA.R.transpose();
  ChartedMotion motion;
  motion.seen.across_mm.resize(N, 4 * (end - first));
  motion.seen.along_mm.resize(N, 2 * (end - first));
  motion.noise_A_mm2.resize(6, N);
  for (Eigen::Index i = 0; i < N; ++i) {
    const SurfaceEvidence& evidence = evidence_[static_cast<std::size_t>(i)];
    Matrix3d noise_W = Matrix3d::Zero();
    for (int band = first; band < end; ++band) {
      const BandPlace place = band_place(layout_, band);
      const Vector3d cosine = R_AW * coefficients_of(evidence, layout_, place.cosine);
      const Vector3d sine = R_AW * coefficients_of(evidence, layout_, place.sine);
      motion.seen.across_mm.row(i).segment<4>(4 * (band - first)) << cosine.x(), cosine.y(), sine.x(), sine.y();
      motion.seen.along_mm.row(i).segment<2>(2 * (band - first)) << cosine.z(), sine.z();
      noise_W += evidence.bands_mm2[static_cast<std::size_t>(band)];
    }
    motion.noise_A_mm2.col(i) = to_six(R_AW * noise_W * R_AW.transpose());
  }
  motion.model = charted_model(own_W_mm, group);
  return motion;
}

std::vector<double> PeriodicSurface::leave_one_out() {
  const auto N = static_cast<Eigen::Index>(evidence_.size());
  const DepthField::LeaveOneOut depth = depth_->leave_one_out();
  Eigen::ArrayXd across = Eigen::ArrayXd::Zero(N);
  Eigen::ArrayXd across_variance = Eigen::ArrayXd::Zero(N);
  Eigen::ArrayXd along = depth.residuals_mm.square();
  Eigen::ArrayXd along_variance = depth.variances_mm2;
  for (const auto& motion : motion_) {
    if (!motion) continue;
    const MotionField::LeaveOneOut left = motion->leave_one_out();
    across += left.across_mm2;
    across_variance += left.across_variance_mm2;
    along += left.along_mm2;
    along_variance += left.along_variance_mm2;
  }
  constexpr double kNone_mm2 = 1e-12;
  const Eigen::ArrayXd nees =
      (2.0 * (across / across_variance.max(kNone_mm2)) + along / along_variance.max(kNone_mm2)) / 3.0;
  agreement_ = {std::sqrt((2.0 * across + along).mean()), nees.mean(), evidence_.size()};
  // The mean over the cycle and two axes is no square of a normal variable, but as large.
  const Eigen::ArrayXd off = (along / along_variance.max(kNone_mm2)).max(across / across_variance.max(kNone_mm2));
  const Eigen::ArrayXd by_depth = depth.residuals_mm.square() / depth.variances_mm2.max(kNone_mm2);
  const Eigen::ArrayXd deviations = off.max(by_depth).sqrt();
  return {deviations.begin(), deviations.end()};
}

bool PeriodicSurface::leave_out_contradicted() {
  std::vector<double> deviations = leave_one_out();
  // What contradicts the others makes all of them look noisy, and so hides itself: what the middle one of them is off
  // by tells the noise without it.
  std::vector<double> sorted = deviations;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double usual = std::clamp(*middle, 0.05, 1.0);
  for (double& deviation : deviations) deviation /= usual;
  // The worst tenth at most: where more contradict, there is nothing that they contradict.
  std::vector<std::size_t> order(evidence_.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return deviations[a] != deviations[b] ? deviations[a] > deviations[b] : a < b;
  });
  std::vector<bool> out(evidence_.size(), false);
  std::size_t left_out = 0;
  for (std::size_t rank = 0; rank < std::max<std::size_t>(1, order.size() / 10); ++rank) {
    if (!(deviations[order[rank]] > settings_.contradiction)) break;
    if (evidence_.size() - left_out <= settings_.fewest_features) break;
    out[order[rank]] = true;
    ++left_out;
  }
  if (left_out == 0) return false;
  std::vector<SurfaceEvidence> kept;
  for (std::size_t i = 0; i < evidence_.size(); ++i) {
    if (out[i]) {
      contradicted_.push_back(evidence_[i].id);
    } else {
      kept.push_back(evidence_[i]);
    }
  }
  evidence_ = std::move(kept);
  return true;
}

// So far from the nearest feature, what is not known there of how the surface curves. An organ may begin to turn away
// within any millimetre.
double PeriodicSurface::turning_variance_mm2(const Vector2d& s, double depth_mm) const {
  constexpr double kRadius_mm = 40.0;  // as a heart's
  const double beyond_mm = support_->beyond_mm(s);
  if (!(beyond_mm > 0.0)) return 0.0;
  // Tangents of depth (s / d, 1).
  const Vector2d slope = depth_->slope_at(s);
  const Vector3d ray(s.x() / chart_.depth_mm, s.y() / chart_.depth_mm, 1.0);
  const Vector3d along_x = slope.x() * ray + depth_mm / chart_.depth_mm * Vector3d::UnitX();
  const Vector3d along_y = slope.y() * ray + depth_mm / chart_.depth_mm * Vector3d::UnitY();
  const Vector3d normal = along_x.cross(along_y);
  const double cosine = std::max(std::abs(normal.dot(ray)) / (normal.norm() * ray.norm()), 0.05);
  const double turning_mm = beyond_mm * beyond_mm / (2.0 * kRadius_mm * cosine * cosine * cosine);
  return turning_mm * turning_mm;
}

PredictedPlaces PeriodicSurface::predict(std::span<const Vector2d> places) const {
  PredictedPlaces out;
  const auto V = static_cast<Eigen::Index>(places.size());
  out.coefficients_W_mm.setZero(3 * V, layout_.size());
  out.covariances_W_mm2.setZero(6, V);
  out.support.resize(places.size());
  for (std::size_t first = 0; first < places.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, places.size() - first);
    predict_block(places.subspan(first, count), static_cast<Eigen::Index>(first), out);
  }
  return out;
}

void PeriodicSurface::put(const ChartedHarmonics& motion, HarmonicGroup group, Eigen::Index first,
                          Eigen::MatrixXd& coefficients_W_mm) const {
  const Matrix3d& R_WA = chart_.X_WA.R;
  const auto [band_first, band_end] = bands_of(layout_, group);
  for (int band = band_first; band < band_end; ++band) {
    const BandPlace place = band_place(layout_, band);
    const Eigen::Index b = band - band_first;
    for (Eigen::Index v = 0; v < motion.along_mm.rows(); ++v) {
      const auto across = motion.across_mm.row(v).segment<4>(4 * b);
      const auto along = motion.along_mm.row(v).segment<2>(2 * b);
      coefficients_W_mm.block<3, 1>(3 * (first + v), place.cosine) = R_WA * Vector3d(across(0), across(1), along(0));
      coefficients_W_mm.block<3, 1>(3 * (first + v), place.sine) = R_WA * Vector3d(across(2), across(3), along(1));
    }
  }
}

void PeriodicSurface::add_motion(const Eigen::Matrix3Xd& p_W_mm, const OwnHarmonics& own_W_mm, Eigen::Index first,
                                 Eigen::MatrixXd& coefficients_W_mm, Matrix6Xd& covariance_A_mm2) const {
  const Eigen::ArrayXXd r_mm = distances(p_W_mm_, p_W_mm);
  for (const HarmonicGroup group : kEveryHarmonicGroup) {
    const auto& motion = motion_[static_cast<std::size_t>(group)];
    if (!motion) continue;
    const MotionField::Prediction predicted = motion->at(r_mm, charted_model(own_W_mm, group));
    covariance_A_mm2 += predicted.covariance_A_mm2;
    put(predicted.motion, group, first, coefficients_W_mm);
  }
}

PredictedMotion PeriodicSurface::motion_at(const Eigen::Matrix3Xd& p_W_mm) const {
  return motion_at(p_W_mm, own_at(p_W_mm));
}

PredictedMotion PeriodicSurface::motion_at(const Eigen::Matrix3Xd& p_W_mm, const OwnHarmonics& own_W_mm) const {
  PredictedMotion out;
  const Eigen::Index V = p_W_mm.cols();
  out.coefficients_W_mm.setZero(3 * V, layout_.size());
  out.covariances_W_mm2.resize(6, V);
  const Matrix3d& R_WA = chart_.X_WA.R;
  for (Eigen::Index first = 0; first < V; first += static_cast<Eigen::Index>(kBlock)) {
    const Eigen::Index count = std::min(static_cast<Eigen::Index>(kBlock), V - first);
    Matrix6Xd covariance_A_mm2 = Matrix6Xd::Zero(6, count);
    const OwnHarmonics own_W = model_ ? OwnHarmonics(own_W_mm.middleRows(3 * first, 3 * count)) : OwnHarmonics();
    add_motion(p_W_mm.middleCols(first, count), own_W, first, out.coefficients_W_mm, covariance_A_mm2);
    for (Eigen::Index v = 0; v < count; ++v) {
      out.covariances_W_mm2.col(first + v) = to_six(R_WA * from_six(covariance_A_mm2.col(v)) * R_WA.transpose());
    }
  }
  return out;
}

PredictedMotion PeriodicSurface::unseen_motion(Eigen::Index places, const OwnHarmonics& own_W_mm) const {
  const Matrix3d& R_WA = chart_.X_WA.R;
  PredictedMotion out;
  out.coefficients_W_mm.setZero(3 * places, layout_.size());
  std::vector<Matrix3d> covariances_A_mm2(static_cast<std::size_t>(places), Matrix3d::Zero());
  for (const HarmonicGroup group : kEveryHarmonicGroup) {
    const auto& motion = motion_[static_cast<std::size_t>(group)];
    if (!motion) continue;
    const ChartedHarmonics own = charted_model(own_W_mm, group);
    if (!motion->gains().empty()) put(scaled(own, motion->gains()), group, 0, out.coefficients_W_mm);
    for (Eigen::Index v = 0; v < places; ++v) {
      covariances_A_mm2[static_cast<std::size_t>(v)] += motion->unseen_A_mm2(own, v);
    }
  }
  out.covariances_W_mm2.resize(6, places);
  for (Eigen::Index v = 0; v < places; ++v) {
    out.covariances_W_mm2.col(v) = to_six(R_WA * covariances_A_mm2[static_cast<std::size_t>(v)] * R_WA.transpose());
  }
  return out;
}

void PeriodicSurface::predict_block(std::span<const Vector2d> places, Eigen::Index first, PredictedPlaces& out) const {
  const auto V = static_cast<Eigen::Index>(places.size());
  const Matrix3d& R_WA = chart_.X_WA.R;
  Eigen::Matrix2Xd s_mm(2, V);
  for (Eigen::Index v = 0; v < V; ++v) s_mm.col(v) = places[static_cast<std::size_t>(v)];
  const DepthField::Prediction depth = depth_->at(s_mm);
  Eigen::Matrix3Xd p_W_mm(3, V);
  Matrix6Xd covariance_A_mm2(6, V);
  for (Eigen::Index v = 0; v < V; ++v) {
    p_W_mm.col(v) = chart_.point_at(s_mm.col(v), depth.depth_mm(v));
    out.coefficients_W_mm.block<3, 1>(3 * (first + v), 0) = p_W_mm.col(v);
    const Vector3d ray_A(s_mm(0, v) / chart_.depth_mm, s_mm(1, v) / chart_.depth_mm, 1.0);
    const double variance_mm2 = depth.variance_mm2(v) + turning_variance_mm2(s_mm.col(v), depth.depth_mm(v));
    covariance_A_mm2.col(v) = variance_mm2 * to_six(ray_A * ray_A.transpose());
  }
  add_motion(p_W_mm, own_at(p_W_mm), first, out.coefficients_W_mm, covariance_A_mm2);
  const double bound_mm2 = settings_.largest_deviation_mm * settings_.largest_deviation_mm;
  for (Eigen::Index v = 0; v < V; ++v) {
    const Matrix3d covariance_A = from_six(covariance_A_mm2.col(v));
    out.covariances_W_mm2.col(first + v) = to_six(R_WA * covariance_A * R_WA.transpose());
    Support& support = out.support[static_cast<std::size_t>(first + v)];
    support = support_->at(places[static_cast<std::size_t>(v)]);
    if (support != Support::kSupported) continue;
    Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
    solver.computeDirect(covariance_A, Eigen::EigenvaluesOnly);
    if (!(depth.depth_mm(v) > 0.0)) {
      support = Support::kOutsideChart;
    } else if (!(solver.eigenvalues()(2) <= bound_mm2)) {
      support = Support::kUncertain;
    }
  }
}

}  // namespace perimap
