#include "core/calibration/tracker_noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/angle/angle.hpp"
#include "core/calibration/one_decimal.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kShortest_s = 10.0;
constexpr std::size_t kFewestPoses = 200;

using Errors = std::vector<Vector6d>;  // rotation, rad, then position, mm

// About the first pose: position in W, rotation in the sensor's frame.
Errors errors_about_first(const std::vector<TimedPose>& poses) {
  Errors errors;
  for (const TimedPose& pose : poses) {
    Vector6d e;
    e << so3_log(poses.front().X.R.transpose() * pose.X.R), pose.X.t - poses.front().X.t;
    errors.push_back(e);
  }
  return errors;
}

// The longest run of half seconds whose means stay together, and in each of which nothing moves. A hand moves a sensor
// by centimetres; a tracker's noise stays within some of its deviations, slow errors within millimetres.
std::vector<TimedPose> longest_still(const std::vector<TimedPose>& poses) {
  constexpr double kBlock_s = 0.5;
  struct Block {
    std::size_t begin;
    std::size_t end;
    Vector3d mean;
    double scatter;  // about the mean
    double noise;    // by second differences, which a smooth motion hardly has
  };
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < poses.size();) {
    std::size_t j = i;
    Vector3d sum = Vector3d::Zero();
    while (j < poses.size() && poses[j].t_s < poses[i].t_s + kBlock_s) sum += poses[j++].X.t;
    const double n = static_cast<double>(j - i);
    Block block{i, j, sum / n, 0.0, 0.0};
    for (std::size_t k = i; k < j; ++k) block.scatter += (poses[k].X.t - block.mean).squaredNorm() / n;
    for (std::size_t k = i + 2; k < j; ++k) {
      block.noise +=
          (poses[k].X.t - 2.0 * poses[k - 1].X.t + poses[k - 2].X.t).squaredNorm() / 6.0 / std::max(1.0, n - 2.0);
    }
    block.scatter = std::sqrt(block.scatter);
    block.noise = std::sqrt(block.noise);
    blocks.push_back(block);
    i = j;
  }
  if (blocks.empty()) return {};
  std::vector<double> noises;
  for (const Block& block : blocks) noises.push_back(block.noise);
  const double noise = upper_median(noises.begin(), noises.end());
  const double together_mm = std::max(8.0, 4.0 * noise);
  const double scatter_mm = std::max(3.0, 2.0 * noise);
  std::size_t best_begin = 0;
  std::size_t best_end = 0;
  for (std::size_t begin = 0; begin < blocks.size();) {
    std::size_t end = begin;
    while (end < blocks.size() && (blocks[end].mean - blocks[begin].mean).norm() <= together_mm &&
           blocks[end].scatter <= scatter_mm) {
      ++end;
    }
    if (end > begin && blocks[end - 1].end - blocks[begin].begin > best_end - best_begin) {
      best_begin = blocks[begin].begin, best_end = blocks[end - 1].end;
    }
    begin = std::max(end, begin + 1);
  }
  return {poses.begin() + static_cast<std::ptrdiff_t>(best_begin),
          poses.begin() + static_cast<std::ptrdiff_t>(best_end)};
}

// Innovations of one axis with unit variance in all, `lasting` of it correlated: y = mean + lasting error + white
// error. The mean has a flat prior, so the first pose only tells it.
struct AxisLikelihood {
  double sum_squares = 0.0;  // of normalised innovations
  double log_variances = 0.0;
  double count = 0.0;
};

AxisLikelihood likelihood_of(const std::vector<TimedPose>& poses, const Errors& errors, int axis, double correlation_s,
                             double lasting) {
  // State (mean, lasting error); P its covariance.
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  constexpr double kFlat = 1e8;  // of the variances that are asked for
  Eigen::Matrix2d P = Eigen::Vector2d(kFlat, lasting).asDiagonal();
  const double white = 1.0 - lasting + 1e-9;
  AxisLikelihood result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i > 0) {
      const double rho = correlation_s > 0.0 ? std::exp(-(poses[i].t_s - poses[i - 1].t_s) / correlation_s) : 0.0;
      x[1] *= rho;
      P(0, 1) *= rho, P(1, 0) *= rho;
      P(1, 1) = rho * rho * P(1, 1) + (1.0 - rho * rho) * lasting;
    }
    const Eigen::Vector2d PH = P.col(0) + P.col(1);
    const double S = PH.sum() + white;
    const double innovation = errors[i][axis] - x.sum();
    if (i > 0) {
      result.sum_squares += innovation * innovation / S;
      result.log_variances += std::log(S);
      result.count += 1.0;
    }
    const Eigen::Vector2d K = PH / S;
    x += K * innovation;
    P -= K * PH.transpose();
  }
  return result;
}

// Of rotation, then of position.
std::array<AxisLikelihood, 2> likelihoods_of(const std::vector<TimedPose>& poses, const Errors& errors,
                                             double correlation_s, double lasting) {
  std::array<AxisLikelihood, 2> sums;
  for (int axis = 0; axis < 6; ++axis) {
    const AxisLikelihood one = likelihood_of(poses, errors, axis, correlation_s, lasting);
    AxisLikelihood& sum = sums[axis < 3 ? 0 : 1];
    sum.sum_squares += one.sum_squares, sum.log_variances += one.log_variances, sum.count += one.count;
  }
  return sums;
}

struct Fit {
  double log_likelihood = -std::numeric_limits<double>::infinity();
  double rotation_variance = 0.0;  // of an axis
  double position_variance = 0.0;
};

Fit fit_of(const std::vector<TimedPose>& poses, const Errors& errors, double correlation_s, double lasting) {
  Fit fit;
  fit.log_likelihood = 0.0;
  const auto sums = likelihoods_of(poses, errors, correlation_s, lasting);
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const AxisLikelihood& sum = sums[kind];
    const double variance = std::max(1e-18, sum.sum_squares / sum.count);
    (kind == 0 ? fit.rotation_variance : fit.position_variance) = variance;
    fit.log_likelihood -= 0.5 * (sum.count * std::log(variance) + sum.log_variances);
  }
  return fit;
}

// Variances of the logarithms of what is fitted.
struct FitCertainty {
  double rotation_variance = 0.0;  // of the variance's logarithm
  double position_variance = 0.0;
  double correlation = 0.0;  // of the time's
};

// By how the likelihood bends about its top (the observed information) in the logarithms of both variances and of the
// time, and in the share that lasts, where that is not at its end.
FitCertainty certainty_of(const std::vector<TimedPose>& poses, const Errors& errors, const Fit& best, double log_tau,
                          double lasting, bool drifts) {
  constexpr double kTauStep = 0.05;
  constexpr double kShareStep = 0.02;
  const bool share_is_free = lasting + kShareStep <= 1.0 && lasting - kShareStep >= 0.0;
  const std::array variances{best.rotation_variance, best.position_variance};
  using Bends = Eigen::Matrix4d;
  // Minus twice the log-likelihood at fixed variances, and the squares that these divide.
  struct At {
    double loss = 0.0;
    std::array<double, 2> squares{};
  };
  const auto at = [&](int tau_steps, int share_steps) {
    const auto sums =
        likelihoods_of(poses, errors, std::exp(log_tau + kTauStep * tau_steps), lasting + kShareStep * share_steps);
    At result;
    for (std::size_t kind = 0; kind < 2; ++kind) {
      result.squares[kind] = sums[kind].sum_squares / variances[kind];
      result.loss += sums[kind].log_variances + result.squares[kind];
    }
    return result;
  };
  Bends H = Bends::Identity();  // variances of rotation and position, time, share
  const At middle = at(0, 0), later = at(1, 0), sooner = at(-1, 0);
  for (int kind = 0; kind < 2; ++kind) {
    const auto k = static_cast<std::size_t>(kind);
    H(kind, kind) = 0.5 * middle.squares[k];
    H(kind, 2) = H(2, kind) = -0.5 * (later.squares[k] - sooner.squares[k]) / (2.0 * kTauStep);
  }
  H(2, 2) = 0.5 * (later.loss - 2.0 * middle.loss + sooner.loss) / (kTauStep * kTauStep);
  if (share_is_free) {
    const At more = at(0, 1), less = at(0, -1);
    for (int kind = 0; kind < 2; ++kind) {
      const auto k = static_cast<std::size_t>(kind);
      H(kind, 3) = H(3, kind) = -0.5 * (more.squares[k] - less.squares[k]) / (2.0 * kShareStep);
    }
    H(3, 3) = 0.5 * (more.loss - 2.0 * middle.loss + less.loss) / (kShareStep * kShareStep);
    H(2, 3) = H(3, 2) =
        0.5 * (at(1, 1).loss - at(1, -1).loss - at(-1, 1).loss + at(-1, -1).loss) / (4.0 * kTauStep * kShareStep);
  }
  const Eigen::LLT<Bends> llt(H);
  // As good as nothing is known of the time.
  constexpr double kOpen = 9.0;
  // No top, or a drift: little more is told of it than variance over time, so that the variance is as open as the time.
  if (drifts || llt.info() != Eigen::Success) {
    return {kOpen + 2.0 / middle.squares[0], kOpen + 2.0 / middle.squares[1], kOpen};
  }
  const Bends C = llt.solve(Bends::Identity());
  return {C(0, 0), C(1, 1), std::min(kOpen, C(2, 2))};
}

std::vector<AllanPoint> allan_of(const std::vector<TimedPose>& poses, const Errors& errors) {
  const double interval_s = (poses.back().t_s - poses.front().t_s) / static_cast<double>(poses.size() - 1);
  std::vector<AllanPoint> points;
  for (std::size_t length = 1; 3 * length <= errors.size(); length = std::max(length + 1, length * 3 / 2)) {
    std::vector<Vector6d> means;
    for (std::size_t i = 0; i + length <= errors.size(); i += length) {
      Vector6d mean = Vector6d::Zero();
      for (std::size_t k = i; k < i + length; ++k) mean += errors[k] / static_cast<double>(length);
      means.push_back(mean);
    }
    Vector6d squares = Vector6d::Zero();
    for (std::size_t i = 1; i < means.size(); ++i) squares += (means[i] - means[i - 1]).cwiseAbs2();
    squares /= 2.0 * static_cast<double>(means.size() - 1);
    points.push_back({interval_s * static_cast<double>(length), std::sqrt(squares.tail<3>().sum()),
                      std::sqrt(squares.head<3>().sum()) / kDegree});
  }
  return points;
}

}  // namespace

Expected<MeasuredNoise> measure_tracker_noise(const std::vector<TimedPose>& all) {
  std::vector<TimedPose> poses = longest_still(all);
  const double still_s = poses.size() > 1 ? poses.back().t_s - poses.front().t_s : 0.0;
  if (still_s < kShortest_s || poses.size() < kFewestPoses) {
    return fail("the sensor was still for " + one_decimal(still_s) + " s and " + std::to_string(poses.size()) +
                " poses, and 10 s and 200 poses are needed, better a minute: clamp it and record again");
  }
  const bool frozen = std::all_of(poses.begin(), poses.end(), [&](const TimedPose& pose) {
    return pose.X.t == poses.front().X.t && pose.X.R == poses.front().X.R;
  });
  if (frozen) {
    return fail(
        "every pose is the same to the last bit: the tracker repeats its last pose, or is simulated without "
        "noise; no noise can be measured");
  }
  // A pair of numbers is looked for, which five thousand poses tell as well as a hundred thousand.
  constexpr std::size_t kMostPoses = 6000;
  const std::size_t stride = std::max<std::size_t>(1, poses.size() / kMostPoses);
  MeasuredNoise noise;
  noise.allan = allan_of(poses, errors_about_first(poses));
  noise.still_s = still_s;
  noise.poses = poses.size();
  if (stride > 1) {
    std::vector<TimedPose> fewer;
    for (std::size_t i = 0; i < poses.size(); i += stride) fewer.push_back(poses[i]);
    poses = std::move(fewer);
  }
  const Errors errors = errors_about_first(poses);
  const double interval_s = still_s / static_cast<double>(poses.size() - 1);
  const double shortest = 0.5 * interval_s;
  const double longest = still_s;
  const double step = std::log(longest / shortest) / 24.0;
  double best_log_tau = std::log(shortest);
  double best_share = 0.0;
  Fit best = fit_of(poses, errors, 0.0, 0.0);
  const auto consider = [&](double log_tau, double share) {
    if (share < 0.0 || share > 1.0 || log_tau > std::log(longest)) return;
    const Fit fit = fit_of(poses, errors, std::exp(log_tau), share);
    if (fit.log_likelihood > best.log_likelihood) best = fit, best_log_tau = log_tau, best_share = share;
  };
  for (int k = 0; k <= 24; ++k) {
    for (const double share : {0.1, 0.5, 0.9, 1.0}) consider(std::log(shortest) + step * k, share);
  }
  double d_tau = step / 2.0, d_share = 0.2;
  constexpr double kFinest = 0.003;  // a tenth of what is known of it in a minute
  while (d_tau > kFinest) {
    const double log_tau = best_log_tau;
    const double share = best_share;
    for (const double a : {-1.0, 0.0, 1.0}) {
      for (const double b : {-1.0, 0.0, 1.0}) consider(log_tau + a * d_tau, share + b * d_share);
    }
    // Time and share go together: along their ridge it takes many steps of one length.
    if (best_log_tau != log_tau || best_share != share) continue;
    d_tau /= 2.0;
    d_share /= 2.0;
  }
  const double tau = std::exp(best_log_tau);
  // What does not last from one pose to the next is white.
  const bool lasts = best_share > 0.05 && tau > 0.7 * interval_s;
  noise.correlation_s = lasts ? tau : 0.0;
  noise.lasting_share = lasts ? best_share : 0.0;
  noise.drifts = lasts && tau > 0.1 * still_s;
  noise.position_deviation_mm = std::sqrt(3.0 * best.position_variance);
  noise.rotation_deviation_deg = std::sqrt(3.0 * best.rotation_variance) / kDegree;
  const double of_poses = 2.0 / (3.0 * static_cast<double>(poses.size()));
  FitCertainty certainty{of_poses, of_poses, 0.0};
  if (lasts) certainty = certainty_of(poses, errors, best, best_log_tau, best_share, noise.drifts);
  // A deviation is half as uncertain as its square.
  noise.position_deviation_mm_deviation = 0.5 * std::sqrt(certainty.position_variance) * noise.position_deviation_mm;
  noise.rotation_deviation_deg_deviation = 0.5 * std::sqrt(certainty.rotation_variance) * noise.rotation_deviation_deg;
  noise.correlation_s_factor = std::exp(std::sqrt(certainty.correlation));
  return noise;
}

}  // namespace perimap
