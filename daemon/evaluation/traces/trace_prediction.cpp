#include "daemon/evaluation/traces/trace_prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

constexpr int kCautiousIterations = 10;  // of the first: while the map is none, samples say little about phases
constexpr double kMoreCaution = 10.0;
constexpr std::size_t kFewestPeaks = 3;
constexpr Eigen::Index kJudged = 6;     // samples that judge the lengths that a cycle may have,
constexpr double kJudgesCaution = 5.0;  // and how many of them tell as much as one that is independent
constexpr double kLeastWeight = 1e-4;
constexpr double kSystole_s = 0.5;

TwoPhaseMap fitted(const TracePredictionSettings& settings, const Eigen::MatrixXd& samples, double period_s,
                   bool cardiac_known, bool first, PhaseTracks& tracks) {
  const int iterations = first ? settings.first_iterations : settings.iterations;
  for (int i = 0; i < iterations; ++i) {
    const TwoPhaseMap map(settings.map, samples, period_s, tracks);
    PhaseSmootherSettings smoother = settings.phases;
    if (first && i < kCautiousIterations) smoother.caution *= kMoreCaution;
    smooth_phases(smoother, map, samples, period_s, cardiac_known, tracks);
  }
  return {settings.map, samples, period_s, tracks};
}

Eigen::MatrixXd residuals(const TwoPhaseMap& map, const Eigen::MatrixXd& samples, const PhaseTracks& tracks) {
  Eigen::MatrixXd left = samples;
  for (Eigen::Index i = 0; i < samples.rows(); ++i) left.row(i) -= map.at(tracks.cardiac[i], tracks.respiratory[i]);
  return left;
}

double expected_length_s(const CycleLengths& cycles) {
  double expected_s = 0.0;
  for (const auto& candidate : cycles.candidates()) expected_s += candidate.weight * candidate.length_s;
  return expected_s;
}

void set_cardiac(const CycleLengths& cycles, double last_length_s, double period_s, PhaseTracks& tracks) {
  for (Eigen::Index i = 0; i < tracks.cardiac.size(); ++i) {
    tracks.cardiac[i] = cycles.phase(static_cast<double>(i) * period_s, last_length_s);
  }
}

}  // namespace

MapPredictions MotionPhasePrediction::predict(const Eigen::MatrixXd& samples, const std::vector<int>& ahead) {
  const bool first = !tracks_;
  if (first) tracks_ = steady_tracks(rates_, period_s_, samples.rows());
  carry_on(*tracks_, period_s_, samples.rows());
  const TwoPhaseMap map = fitted(settings_, samples, period_s_, false, first, *tracks_);
  const Eigen::MatrixXd left = residuals(map, samples, *tracks_);
  const Eigen::MatrixXd of_residual =
      VectorAutoregression(settings_.residual, left, noise_).predict(left, ahead.back());
  const Eigen::Index newest = samples.rows() - 1;
  const auto count = static_cast<Eigen::Index>(ahead.size());
  MapPredictions result{Eigen::MatrixXd(count, samples.cols()), Eigen::MatrixXd(count, samples.cols())};
  for (Eigen::Index k = 0; k < count; ++k) {
    const int h = ahead[static_cast<std::size_t>(k)];
    result.map.row(k) = map.at(tracks_->cardiac[newest] + h * period_s_ * tracks_->cardiac_rate[newest],
                               tracks_->respiratory[newest] + h * period_s_ * tracks_->respiratory_rate[newest]);
    result.with_residual.row(k) = result.map.row(k) + of_residual.row(h - 1);
  }
  return result;
}

TwoPhaseMap RPeakPrediction::fit(const Eigen::MatrixXd& samples, const CycleLengths& cycles, double last_length_s,
                                 bool first, PhaseTracks& tracks) const {
  set_cardiac(cycles, last_length_s, period_s_, tracks);
  return fitted(settings_, samples, period_s_, true, first, tracks);
}

void RPeakPrediction::choose_law(const Eigen::MatrixXd& samples, const std::vector<double>& known_s,
                                 double known_until_s) {
  double least = std::numeric_limits<double>::infinity();
  for (const double systole_s : {0.0, kSystole_s}) {
    const CycleLengths cycles(known_s, known_until_s, systole_s);
    PhaseTracks tracks = steady_tracks(rates_, period_s_, samples.rows());
    const TwoPhaseMap map = fit(samples, cycles, expected_length_s(cycles), true, tracks);
    const double left = map.variance().cwiseQuotient(noise_.cwiseAbs2().transpose()).sum();
    if (left >= least) continue;
    least = left;
    systole_s_ = systole_s;
    tracks_ = tracks;
  }
}

std::optional<MapPredictions> RPeakPrediction::predict(const Eigen::MatrixXd& samples, const std::vector<int>& ahead) {
  const Eigen::Index newest = samples.rows() - 1;
  const double known_until_s = static_cast<double>(newest) * period_s_ - settings_.detector_delay_s;
  const auto unknown = std::upper_bound(peaks_s_.begin(), peaks_s_.end(), known_until_s);
  if (static_cast<std::size_t>(unknown - peaks_s_.begin()) < kFewestPeaks) return std::nullopt;
  const std::vector<double> known_s(peaks_s_.begin(), unknown);
  const auto time_s = [&](Eigen::Index i) { return static_cast<double>(i) * period_s_; };
  const bool first = !tracks_;
  if (first) choose_law(samples, known_s, known_until_s);
  carry_on(*tracks_, period_s_, samples.rows());
  const CycleLengths cycles(known_s, known_until_s, systole_s_);
  double expected_s = expected_length_s(cycles);
  TwoPhaseMap map = fit(samples, cycles, expected_s, false, *tracks_);

  // How likely each length is: by the cycles before, and by the last samples.
  std::vector<double> weight;
  double most = -std::numeric_limits<double>::infinity();
  for (const auto& candidate : cycles.candidates()) {
    double log_weight = std::log(candidate.weight);
    for (Eigen::Index i = std::max<Eigen::Index>(0, newest + 1 - kJudged); i <= newest; ++i) {
      const Eigen::RowVectorXd off =
          samples.row(i) - map.at(cycles.phase(time_s(i), candidate.length_s), tracks_->respiratory[i]);
      log_weight -= 0.5 * off.cwiseAbs2().cwiseQuotient(map.variance()).sum() / kJudgesCaution;
    }
    weight.push_back(log_weight);
    most = std::max(most, log_weight);
  }
  double sum = 0.0;
  for (double& w : weight) sum += w = std::exp(w - most);
  expected_s = 0.0;
  for (std::size_t c = 0; c < weight.size(); ++c) {
    weight[c] /= sum;
    expected_s += weight[c] * cycles.candidates()[c].length_s;
  }
  set_cardiac(cycles, expected_s, period_s_, *tracks_);
  map = TwoPhaseMap(settings_.map, samples, period_s_, *tracks_);

  const Eigen::MatrixXd left = residuals(map, samples, *tracks_);
  const VectorAutoregression autoregression(settings_.residual, left, noise_);
  const auto count = static_cast<Eigen::Index>(ahead.size());
  MapPredictions result{Eigen::MatrixXd::Zero(count, samples.cols()), Eigen::MatrixXd::Zero(count, samples.cols())};
  double told = 0.0;
  for (std::size_t c = 0; c < weight.size(); ++c) {
    if (weight[c] < kLeastWeight) continue;
    const double length_s = cycles.candidates()[c].length_s;
    Eigen::MatrixXd of_this = left;
    for (Eigen::Index i = std::max<Eigen::Index>(0, newest - settings_.residual.lags); i <= newest; ++i) {
      of_this.row(i) = samples.row(i) - map.at(cycles.phase(time_s(i), length_s), tracks_->respiratory[i]);
    }
    const Eigen::MatrixXd of_residual = autoregression.predict(of_this, ahead.back());
    for (Eigen::Index k = 0; k < count; ++k) {
      const int h = ahead[static_cast<std::size_t>(k)];
      const Eigen::RowVectorXd position =
          map.at(cycles.phase(time_s(newest + h), length_s),
                 tracks_->respiratory[newest] + h * period_s_ * tracks_->respiratory_rate[newest]);
      result.map.row(k) += weight[c] * position;
      result.with_residual.row(k) += weight[c] * (position + of_residual.row(h - 1));
    }
    told += weight[c];
  }
  result.map /= told;
  result.with_residual /= told;
  return result;
}

}  // namespace perimap
