#include "daemon/evaluation/report/accuracy.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

namespace perimap {
namespace {

constexpr double kSettledAfter_s = 15.0;
constexpr double kPathLength_s = 1.0;
constexpr double kOff_mm = 3.0;
constexpr Duration kFrame = std::chrono::milliseconds(34);  // at 30 frames a second

ErrorFigures figures_of(std::vector<double> errors) {
  ErrorFigures figures;
  figures.count = errors.size();
  if (errors.empty()) return figures;
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&errors](double q) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(errors.size())));
    return errors[std::max<std::size_t>(rank, 1) - 1];
  };
  double squares = 0.0;
  for (const double error : errors) squares += error * error;
  figures.rms_mm = std::sqrt(squares / static_cast<double>(errors.size()));
  figures.median_mm = quantile(0.5);
  figures.p95_mm = quantile(0.95);
  figures.max_mm = errors.back();
  return figures;
}

// Collects errors into stretches that follow one another.
class Spans {
 public:
  explicit Spans(std::vector<double> edges)
      : edges_(std::move(edges)), errors_(edges_.size()), nees_(edges_.size()), last_(edges_.size()) {}

  void add_sample(double t, std::size_t converged) {
    if (const auto i = index(t)) last_[*i] = converged;
  }
  void add_error(double t, double error, double nees) {
    const auto i = index(t);
    if (!i) return;
    errors_[*i].push_back(error);
    nees_[*i] += nees;
  }
  [[nodiscard]] std::vector<ErrorSpan> figures() const {
    std::vector<ErrorSpan> spans;
    for (std::size_t i = 0; i + 1 < edges_.size(); ++i) {
      const double nees = errors_[i].empty() ? kNoFigure : nees_[i] / static_cast<double>(errors_[i].size());
      spans.push_back({edges_[i], edges_[i + 1], figures_of(errors_[i]), nees, last_[i]});
    }
    return spans;
  }

 private:
  [[nodiscard]] std::optional<std::size_t> index(double t) const {
    const auto after = std::upper_bound(edges_.begin(), edges_.end(), t);
    if (after == edges_.begin() || after == edges_.end()) return std::nullopt;
    return static_cast<std::size_t>(after - edges_.begin()) - 1;
  }

  std::vector<double> edges_;
  std::vector<std::vector<double>> errors_;
  std::vector<double> nees_;  // sums
  std::vector<std::size_t> last_;
};

}  // namespace

Accuracy::Accuracy(const GroundTruth& truth, const CameraModel& camera, Instant first_frame)
    : truth_(truth), camera_(camera), first_frame_(first_frame) {
  // Surfaces may come on a thread with deadlines: a minute of them without growing.
  published_.reserve(std::size_t{1} << 18);
  samples_.reserve(std::size_t{1} << 12);
}

void Accuracy::add(const perimap_Surface& sample) {
  const std::size_t begin = published_.size();
  for (std::uint32_t i = 0; i < sample.features._length; ++i) {
    const perimap_SurfaceFeature& feature = sample.features._buffer[i];
    if (feature.state == perimap_FEATURE_INVALID) continue;
    const double* c = feature.covariance_W_mm2;
    Published published;
    published.id = feature.id;
    published.converged = feature.state == perimap_FEATURE_CONVERGED;
    published.p_W_mm = Vector3d(feature.position_W_mm[0], feature.position_W_mm[1], feature.position_W_mm[2]);
    published.P_mm2 << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    published_.push_back(published);
  }
  samples_.push_back(
      {from_ns(sample.valid_time_ns), from_ns(sample.release_time_ns), sample.state, begin, published_.size()});
}

void Accuracy::add(const perimap_SurfaceModel& model) {
  for (std::uint32_t i = 0; i < model.features._length; ++i) {
    const perimap_ModelFeature& feature = model.features._buffer[i];
    origins_.try_emplace(feature.id, Origin{from_ns(feature.first_observed_time_ns),
                                            Vector2d(feature.first_observed_px[0], feature.first_observed_px[1])});
  }
}

std::map<std::uint32_t, SurfacePoint> Accuracy::resolve_origins(Duration to_recording) const {
  std::map<std::uint32_t, SurfacePoint> points;
  for (const auto& [id, origin] : origins_) {
    const Instant first_observed = origin.first_observed + to_recording;
    const auto X_WC = truth_.camera_pose(first_observed);
    Vector3d ray_C;
    if (!X_WC || !camera_.unproject(origin.px, ray_C)) continue;
    if (const auto point = truth_.first_hit(*X_WC, ray_C, first_observed)) points.emplace(id, *point);
  }
  return points;
}

bool Accuracy::before_premature_beat_is_known(Instant released) const {
  for (std::size_t i = 1; i < beats_.size(); ++i) {
    if (beats_[i].beat_class != BeatClass::kPremature) continue;
    if (released >= beats_[i - 1].time && released <= beats_[i].detected_at + kFrame) return true;
  }
  return false;
}

AccuracyReport Accuracy::report(Duration to_recording) const {
  AccuracyReport report;
  report.samples = samples_.size();
  if (samples_.empty()) return report;
  const auto points = resolve_origins(to_recording);
  const auto since_start = [this](Instant t) { return to_seconds(t - first_frame_); };
  const double end_s = since_start(samples_.back().valid_time + to_recording);

  std::vector<double> second_edges;
  for (int t = 0; t <= end_s + 1.0; ++t) second_edges.push_back(t);
  std::vector<double> cycle_edges;
  for (const Instant r : truth_.motion().r_peaks) {
    if (const double t = since_start(r); t >= 0.0 && t <= end_s) cycle_edges.push_back(t);
  }
  Spans seconds(second_edges);
  Spans cycles(cycle_edges);

  std::set<std::uint32_t> seen;
  std::map<std::uint32_t, double> converged_at;
  std::map<std::uint32_t, std::vector<double>> feature_errors;
  std::map<std::uint32_t, FeaturePath> paths;
  std::set<std::uint32_t> without_truth;
  std::set<std::uint32_t> off;
  std::vector<double> settled;
  double nees_sum = 0.0;
  double good_squares = 0.0;
  double good_nees_sum = 0.0;
  report.good.premature_beats = static_cast<std::size_t>(std::count_if(
      beats_.begin(), beats_.end(), [](const RPeak& beat) { return beat.beat_class == BeatClass::kPremature; }));
  for (const SampleRange& sample : samples_) {
    const Instant valid_time = sample.valid_time + to_recording;
    const double t = since_start(valid_time);
    const bool early = before_premature_beat_is_known(sample.released + to_recording);
    if (t >= kSettledAfter_s) {
      ++report.settled_samples;
      report.degraded += sample.state == perimap_SURFACE_DEGRADED ? 1 : 0;
      report.invalid += sample.state == perimap_SURFACE_INVALID ? 1 : 0;
    }
    std::size_t converged = 0;
    for (std::size_t i = sample.begin; i < sample.end; ++i) {
      const Published& feature = published_[i];
      seen.insert(feature.id);
      if (feature.converged) {
        ++converged;
        converged_at.try_emplace(feature.id, t);
      }
      if (!converged_at.contains(feature.id)) continue;
      const auto point = points.find(feature.id);
      if (point == points.end()) {
        without_truth.insert(feature.id);
        continue;
      }
      const Vector3d p_true = truth_.position(point->second, valid_time);
      const Vector3d e = feature.p_W_mm - p_true;
      const double error = e.norm();
      const double nees = e.dot(feature.P_mm2.ldlt().solve(e)) / 3.0;
      seconds.add_error(t, error, nees);
      cycles.add_error(t, error, nees);
      feature_errors[feature.id].push_back(error);
      if (feature.converged && sample.state == perimap_SURFACE_GOOD) {
        ++report.good.count;
        good_squares += error * error;
        good_nees_sum += nees;
        double& largest = early ? report.good.largest_before_known_mm : report.good.largest_mm;
        largest = std::fmax(largest, error);
        if (error > kOff_mm) {
          ++(early ? report.good.off_before_known : report.good.off);
          if (!early) off.insert(feature.id);
        }
      }
      if (t >= kSettledAfter_s) {
        settled.push_back(error);
        nees_sum += nees;
      }
      if (t >= end_s - kPathLength_s) {
        paths[feature.id].published.push_back(feature.p_W_mm);
        paths[feature.id].truth.push_back(p_true);
      }
    }
    if (t <= kSettledAfter_s) report.converged_at_15_s = converged;
    seconds.add_sample(t, converged);
    cycles.add_sample(t, converged);
  }

  report.features_published = seen.size();
  report.features_converged = converged_at.size();
  report.converged_by_15_s = static_cast<std::size_t>(std::count_if(
      converged_at.begin(), converged_at.end(), [](const auto& c) { return c.second <= kSettledAfter_s; }));
  report.features_without_truth = without_truth.size();
  report.good.features_off = off.size();
  if (report.good.count > 0) {
    const auto count = static_cast<double>(report.good.count);
    report.good.rms_mm = std::sqrt(good_squares / count);
    report.good.mean_nees = good_nees_sum / count;
  }
  report.settled = figures_of(settled);
  if (!settled.empty()) {
    report.mean_nees = nees_sum / static_cast<double>(settled.size());
    const auto above = std::count_if(settled.begin(), settled.end(), [](double e) { return e > kOff_mm; });
    report.share_above_3_mm = static_cast<double>(above) / static_cast<double>(settled.size());
  }
  report.seconds = seconds.figures();
  report.cycles = cycles.figures();
  for (auto& [id, errors] : feature_errors) {
    FeaturePath path = std::move(paths[id]);
    path.id = id;
    path.error = figures_of(std::move(errors));
    report.paths.push_back(std::move(path));
  }
  return report;
}

}  // namespace perimap
