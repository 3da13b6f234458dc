#include "drivers/standins/trace/phase_smoother.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// What hearts under surgery and ventilators do: 0.7 to 2.6 Hz and 0.1 to 0.6 Hz.
constexpr double kSlowestHeart = 0.7;
constexpr double kSlowestBreath = 0.1;
constexpr double kStep = 0.01;
constexpr int kHearts = 190, kBreaths = 50;  // steps
constexpr int kCardiac = 3;                  // harmonics that the search looks at
constexpr int kRespiratory = 2;

// Before anything is seen: rad, rad/s.
constexpr double kPhase = 0.7;
constexpr double kCardiacRate = 0.55;
constexpr double kRespiratoryRate = 0.22;

Eigen::MatrixXd harmonics(double rate_hz, int how_many, double period_s, Eigen::Index samples) {
  Eigen::MatrixXd columns(samples, 2 * how_many);
  for (Eigen::Index i = 0; i < samples; ++i) {
    for (int k = 1; k <= how_many; ++k) {
      const double phase = k * kTwoPi * rate_hz * static_cast<double>(i) * period_s;
      columns(i, 2 * k - 2) = std::cos(phase);
      columns(i, 2 * k - 1) = std::sin(phase);
    }
  }
  return columns;
}

// Phase and rate of the heart, then of breathing.
using State = Eigen::Vector4d;

struct Step {
  State predicted = State::Zero();
  State filtered = State::Zero();
  Eigen::Matrix4d predicted_P = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d filtered_P = Eigen::Matrix4d::Zero();
};

Eigen::Matrix4d process_noise(const PhaseSmootherSettings& settings, double dt) {
  Eigen::Matrix4d Q = Eigen::Matrix4d::Zero();
  Eigen::Matrix2d walk;
  walk << dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt;
  Q.topLeftCorner<2, 2>() = settings.cardiac_noise * walk;
  Q.bottomRightCorner<2, 2>() = settings.respiratory_noise * walk;
  return Q;
}

}  // namespace

PhaseRates find_rates(const Eigen::MatrixXd& samples, double period_s, const Eigen::VectorXd& noise) {
  const Eigen::Index count = samples.rows();
  const Eigen::MatrixXd Z = (samples.rowwise() - samples.colwise().mean()) * noise.cwiseInverse().asDiagonal();
  PhaseRates best;
  double most = -std::numeric_limits<double>::infinity();
  Eigen::MatrixXd B(count, 1 + 2 * (kCardiac + kRespiratory));
  B.col(0).setOnes();
  for (int slower = 0; slower < kBreaths; ++slower) {
    const double breath = kSlowestBreath + slower * kStep;
    B.rightCols(2 * kRespiratory) = harmonics(breath, kRespiratory, period_s, count);
    for (int slow = 0; slow < kHearts; ++slow) {
      const double heart = kSlowestHeart + slow * kStep;
      B.middleCols(1, 2 * kCardiac) = harmonics(heart, kCardiac, period_s, count);
      const Eigen::MatrixXd by_channel = B.transpose() * Z;
      const Eigen::MatrixXd normal = B.transpose() * B + 1e-3 * Eigen::MatrixXd::Identity(B.cols(), B.cols());
      const double explained = by_channel.cwiseProduct(normal.ldlt().solve(by_channel)).sum();
      if (explained <= most) continue;
      most = explained;
      best = {heart, breath};
    }
  }
  return best;
}

PhaseTracks steady_tracks(const PhaseRates& rates, double period_s, Eigen::Index count) {
  PhaseTracks tracks;
  tracks.cardiac_rate = Eigen::VectorXd::Constant(1, kTwoPi * rates.cardiac_hz);
  tracks.respiratory_rate = Eigen::VectorXd::Constant(1, kTwoPi * rates.respiratory_hz);
  tracks.cardiac = Eigen::VectorXd::Zero(1);
  tracks.respiratory = Eigen::VectorXd::Zero(1);
  carry_on(tracks, period_s, count);
  return tracks;
}

void carry_on(PhaseTracks& tracks, double period_s, Eigen::Index count) {
  const auto carry = [&](Eigen::VectorXd& phase, Eigen::VectorXd& rate) {
    const Eigen::Index had = phase.size();
    phase.conservativeResize(count);
    rate.conservativeResize(count);
    for (Eigen::Index i = had; i < count; ++i) {
      rate[i] = rate[i - 1];
      phase[i] = phase[i - 1] + rate[i - 1] * period_s;
    }
  };
  carry(tracks.cardiac, tracks.cardiac_rate);
  carry(tracks.respiratory, tracks.respiratory_rate);
}

void smooth_phases(const PhaseSmootherSettings& settings, const TwoPhaseMap& map, const Eigen::MatrixXd& samples,
                   double period_s, bool cardiac_known, PhaseTracks& tracks) {
  const Eigen::Index count = samples.rows();
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F(0, 1) = F(2, 3) = period_s;
  const Eigen::Matrix4d Q = process_noise(settings, period_s);
  const Eigen::RowVectorXd weight = (settings.caution * map.variance()).cwiseInverse();
  std::vector<Step> steps(static_cast<std::size_t>(count));
  State x(tracks.cardiac[0], tracks.cardiac_rate[0], tracks.respiratory[0], tracks.respiratory_rate[0]);
  Eigen::Matrix4d P =
      State(kPhase * kPhase, kCardiacRate * kCardiacRate, kPhase * kPhase, kRespiratoryRate * kRespiratoryRate)
          .asDiagonal();
  for (Eigen::Index i = 0; i < count; ++i) {
    Step& step = steps[static_cast<std::size_t>(i)];
    if (i > 0) {
      x = F * x;
      P = F * P * F.transpose() + Q;
    }
    step.predicted = x;
    step.predicted_P = P;
    const TwoPhaseMap::Slopes map_at = map.slopes(tracks.cardiac[i], tracks.respiratory[i]);
    Eigen::Matrix<double, Eigen::Dynamic, 2> J(samples.cols(), 2);
    J.setZero();
    if (!cardiac_known) J.col(0) = map_at.along_cardiac.transpose();
    J.col(1) = map_at.along_respiratory.transpose();
    // In information form: many channels, two phases.
    const Eigen::Matrix<double, 2, Eigen::Dynamic> JtR = J.transpose() * weight.asDiagonal();
    const Eigen::Vector2d off(x[0] - tracks.cardiac[i], x[2] - tracks.respiratory[i]);
    const Eigen::Vector2d gradient = JtR * (samples.row(i) - map_at.at).transpose() - JtR * J * off;
    Eigen::Matrix<double, 4, 2> H = Eigen::Matrix<double, 4, 2>::Zero();
    H(0, 0) = H(2, 1) = 1.0;
    P = (P.inverse() + H * (JtR * J) * H.transpose()).inverse().eval();
    x += P * H * gradient;
    step.filtered = x;
    step.filtered_P = P;
  }
  for (Eigen::Index i = count - 1; i >= 0; --i) {
    const Step& step = steps[static_cast<std::size_t>(i)];
    if (i < count - 1) {
      const Step& next = steps[static_cast<std::size_t>(i + 1)];
      x = step.filtered + step.filtered_P * F.transpose() * next.predicted_P.ldlt().solve(x - next.predicted);
    }
    if (!cardiac_known) {
      tracks.cardiac[i] = x[0];
      tracks.cardiac_rate[i] = x[1];
    }
    tracks.respiratory[i] = x[2];
    tracks.respiratory_rate[i] = x[3];
  }
}

}  // namespace perimap
