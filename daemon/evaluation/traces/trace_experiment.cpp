#include "daemon/evaluation/traces/trace_experiment.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace perimap {
namespace {

constexpr double kMemory_s = 10.0;         // of past errors, in the covariance that is told
constexpr double kFloor_mm2 = 1e-4;        // of an axis
constexpr double kShortestBefore_s = 6.0;  // a breath and some beats

// Members of ours that are no row.
constexpr const char* kByMotion = "map by motion";
constexpr const char* kByPeaks = "map by R peaks";

// Errors of one predictor at one horizon, by the sample predicted from.
using Errors = std::map<Eigen::Index, Eigen::RowVectorXd>;

// Of each channel.
Eigen::VectorXd noise_of(const TraceExperimentSettings& settings, Eigen::Index channels) {
  Eigen::VectorXd noise = Eigen::VectorXd::Constant(channels, settings.lateral_noise_mm);
  for (Eigen::Index depth = 2; depth < channels; depth += 3) noise[depth] = settings.depth_noise_mm;
  return noise;
}

// An autoregression that is fitted anew now and then, about the mean so far.
class Refitted {
 public:
  Refitted(const VectorAutoregressionSettings& settings, int every, const Eigen::VectorXd& noise)
      : settings_(settings), every_(every), noise_(noise) {}

  [[nodiscard]] Eigen::MatrixXd predict(const Eigen::MatrixXd& samples, int count) {
    if (!fitted_ || samples.rows() - fitted_at_ >= every_) {
      mean_ = samples.colwise().mean();
      fitted_.emplace(settings_, samples.rowwise() - mean_, noise_);
      fitted_at_ = samples.rows();
    }
    return fitted_->predict(samples.rowwise() - mean_, count).rowwise() + mean_;
  }

  void fit_anew() { fitted_.reset(); }

 private:
  VectorAutoregressionSettings settings_;
  int every_;
  Eigen::VectorXd noise_;
  Eigen::RowVectorXd mean_;
  std::optional<VectorAutoregression> fitted_;
  Eigen::Index fitted_at_ = 0;
};

class Run {
 public:
  Run(const TraceExperimentSettings& settings, const MotionTrace& trace, const std::vector<double>& r_peaks_s)
      : settings_(settings),
        trace_(trace),
        peaks_s_(r_peaks_s),
        noise_(noise_of(settings, trace.positions.cols())),
        begin_(std::max(settings.from - settings.warm_up, settings.of_a_point.lags + 2)),
        all_(settings.of_all, settings.fitted_every, noise_) {
    for (const double horizon_s : settings.horizons_s) {
      ahead_.push_back(std::max(1, static_cast<int>(std::lround(horizon_s / trace.period_s))));
    }
    for (double& peak_s : peaks_s_) peak_s -= trace.first_s;
    for (std::size_t p = 0; p < trace.points.size(); ++p) {
      of_point_.emplace_back(settings.of_a_point, settings.fitted_every, noise_.head(3));
    }
  }

  TraceExperiment run(const std::function<void(int)>& progress) {
    for (Eigen::Index i = begin_; i <= settings_.to; ++i) {
      if (i == begin_ || i == settings_.from) begin_anew(i);
      predict_from(i);
      if (i >= settings_.from) progress(static_cast<int>(i) - settings_.from + 1);
    }
    TraceExperiment experiment;
    experiment.rates = rates_;
    experiment.with_r_peaks = r_peaks_.has_value();
    experiment.from = settings_.from;
    experiment.to = settings_.to;
    for (const char* name : {"hold", "ar_point", "ar_all", "periodic", "ours"}) {
      for (std::size_t k = 0; k < ahead_.size(); ++k) {
        experiment.rows.push_back(row(name, k, {}));
        for (std::size_t p = 0; p < trace_.points.size(); ++p) experiment.rows.push_back(row(name, k, p));
      }
    }
    return experiment;
  }

 private:
  // Rates and phases are searched for in all samples so far, and what is fitted now and then is fitted.
  void begin_anew(Eigen::Index newest) {
    const TracePredictionSettings& settings = settings_.prediction;
    rates_ = find_rates(trace_.positions.topRows(newest + 1), trace_.period_s, noise_);
    motion_.emplace(settings, trace_.period_s, rates_, noise_);
    if (!peaks_s_.empty()) r_peaks_.emplace(settings, trace_.period_s, rates_, noise_, peaks_s_);
    all_.fit_anew();
    for (Refitted& of_point : of_point_) of_point.fit_anew();
  }

  void note(const std::string& name, Eigen::Index from, std::size_t horizon, const Eigen::RowVectorXd& predicted) {
    const Eigen::Index at = from + ahead_[horizon];
    if (at < trace_.samples()) errors_[name][horizon][from] = trace_.positions.row(at) - predicted;
  }

  void predict_from(Eigen::Index newest) {
    const Eigen::MatrixXd samples = trace_.positions.topRows(newest + 1);
    const int farthest = ahead_.back();
    const MapPredictions by_motion = motion_->predict(samples, ahead_);
    const auto by_peaks = r_peaks_ ? r_peaks_->predict(samples, ahead_) : std::nullopt;
    const Eigen::MatrixXd by_all = all_.predict(samples, farthest);
    Eigen::MatrixXd by_point(farthest, samples.cols());
    for (std::size_t p = 0; p < of_point_.size(); ++p) {
      const auto column = static_cast<Eigen::Index>(3 * p);
      by_point.middleCols(column, 3) = of_point_[p].predict(samples.middleCols(column, 3), farthest);
    }
    for (std::size_t k = 0; k < ahead_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const Eigen::RowVectorXd autoregression = by_all.row(ahead_[k] - 1);
      std::vector<std::pair<std::string, Eigen::RowVectorXd>> members = {{"ar_all", autoregression},
                                                                         {kByMotion, by_motion.with_residual.row(row)}};
      if (by_peaks) members.emplace_back(kByPeaks, by_peaks->with_residual.row(row));
      const Eigen::RowVectorXd ours = mean_by_merit(members, newest, k);
      for (const auto& [name, predicted] : members) note(name, newest, k, predicted);
      note("hold", newest, k, samples.row(newest));
      note("ar_point", newest, k, by_point.row(ahead_[k] - 1));
      note("periodic", newest, k, by_peaks ? by_peaks->map.row(row) : by_motion.map.row(row));
      note("ours", newest, k, ours);
    }
  }

  // The mean of the members, each with a weight of its mean squared error so far (in units of noise) to the power of
  // -2: alike where they are alike, and hardly where one is far worse.
  [[nodiscard]] Eigen::RowVectorXd mean_by_merit(const std::vector<std::pair<std::string, Eigen::RowVectorXd>>& members,
                                                 Eigen::Index newest, std::size_t horizon) {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(noise_.size());
    double weights = 0.0;
    for (const auto& [name, predicted] : members) {
      double squares = 0.0;
      double count = 0.0;
      for (const auto& [start, error] : errors_[name][horizon]) {
        if (start + ahead_[horizon] > newest) break;
        const double fading = std::exp(-static_cast<double>(newest - start) * trace_.period_s / kMemory_s);
        squares += fading * error.cwiseQuotient(noise_.transpose()).squaredNorm();
        count += fading;
      }
      const double merit = count > 0.0 ? count / squares : 1.0;
      sum += merit * predicted;
      weights += merit;
    }
    return sum / weights;
  }

  // Of the errors that were known by then, newer ones counting more.
  [[nodiscard]] Eigen::Matrix3d covariance(const Errors& errors, Eigen::Index from, int ahead,
                                           std::size_t point) const {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    double weights = 0.0;
    for (const auto& [start, error] : errors) {
      if (start + ahead > from) break;
      const double weight = std::exp(-static_cast<double>(from - start) * trace_.period_s / kMemory_s);
      const Eigen::Vector3d e = error.segment(static_cast<Eigen::Index>(3 * point), 3).transpose();
      sum += weight * e * e.transpose();
      weights += weight;
    }
    return sum / weights + kFloor_mm2 * Eigen::Matrix3d::Identity();
  }

  [[nodiscard]] TraceRow row(const std::string& name, std::size_t horizon, std::optional<std::size_t> only) {
    const Errors& errors = errors_[name][horizon];
    TraceRow result;
    result.name = name;
    result.point = only ? trace_.points[*only] : kAllPoints;
    result.horizon_ms = 1e3 * ahead_[horizon] * trace_.period_s;
    double squares = 0.0;
    double lateral = 0.0;
    double normalised = 0.0;
    int count = 0;
    for (auto at = errors.lower_bound(settings_.from); at != errors.end(); ++at) {
      ++result.starts;
      for (std::size_t p = only.value_or(0); p < (only ? *only + 1 : trace_.points.size()); ++p) {
        const Eigen::Vector3d e = at->second.segment(static_cast<Eigen::Index>(3 * p), 3).transpose();
        squares += e.squaredNorm();
        lateral += e.head<2>().squaredNorm();
        if (name == "ours")
          normalised += e.dot(covariance(errors, at->first, ahead_[horizon], p).ldlt().solve(e)) / 3.0;
        ++count;
      }
    }
    result.rmse_mm = std::sqrt(squares / count);
    result.rmse_lateral_mm = std::sqrt(lateral / count);
    result.nees = name == "ours" ? normalised / count : std::nan("");
    return result;
  }

  const TraceExperimentSettings& settings_;
  const MotionTrace& trace_;
  std::vector<double> peaks_s_;  // since the first sample
  Eigen::VectorXd noise_;        // of each channel
  Eigen::Index begin_;
  Refitted all_;
  std::vector<Refitted> of_point_;
  std::vector<int> ahead_;
  PhaseRates rates_;
  std::optional<MotionPhasePrediction> motion_;
  std::optional<RPeakPrediction> r_peaks_;
  std::map<std::string, std::map<std::size_t, Errors>> errors_;
};

}  // namespace

Expected<TraceExperiment> run_trace_experiment(const TraceExperimentSettings& settings, const MotionTrace& trace,
                                               const std::vector<double>& r_peaks_s,
                                               const std::function<void(int)>& progress) {
  const double longest_s = *std::max_element(settings.horizons_s.begin(), settings.horizons_s.end());
  const auto farthest = std::max<Eigen::Index>(1, std::lround(longest_s / trace.period_s));
  const Eigen::Index last = trace.samples() - 1;
  if (settings.to < settings.from) return fail("--to: before --from: there is nothing to predict from");
  const double before_s = settings.from * trace.period_s;
  if (before_s < kShortestBefore_s || settings.from < settings.warm_up) {
    return fail(
        fmt::format("--from: sample {} has {:.1f} s before it; at least {:g} s and {} samples are needed to know "
                    "heart and breathing by",
                    settings.from, before_s, kShortestBefore_s, settings.warm_up));
  }
  if (settings.to + farthest > last) {
    return fail(fmt::format("--to: {} ms after sample {} the trace is over; the last that can be predicted from is {}",
                            std::lround(1e3 * longest_s), settings.to, last - farthest));
  }
  return Run(settings, trace, r_peaks_s).run(progress);
}

}  // namespace perimap
