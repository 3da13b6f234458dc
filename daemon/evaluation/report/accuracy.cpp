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

// Of features that are seen for the first time.
class NewTally {
 public:
  // Of each published position. `seen_s`: when the feature was first seen, `t_s`: of the sample.
  void add(std::uint32_t id, double seen_s, double t_s, bool converged) {
    if (seen_s < kMapAfter_s) return;
    to_published_s_.try_emplace(id, t_s - seen_s);
    if (converged) to_converged_s_.try_emplace(id, t_s - seen_s);
  }
  void add_error(double seen_s, double t_s, bool converged, double error_mm, double nees) {
    if (seen_s < kMapAfter_s || t_s - seen_s > kYoung_s || !converged) return;
    errors_mm_.push_back(error_mm);
    nees_ += nees;
  }
  [[nodiscard]] NewFeatures figures() const {
    NewFeatures figures;
    figures.published = to_published_s_.size();
    figures.converged = to_converged_s_.size();
    figures.to_published_s = middle(to_published_s_);
    figures.to_converged_s = middle(to_converged_s_);
    figures.young = figures_of(errors_mm_);
    if (!errors_mm_.empty()) figures.young_nees = nees_ / static_cast<double>(errors_mm_.size());
    return figures;
  }

 private:
  static constexpr double kMapAfter_s = 5.0;
  static constexpr double kYoung_s = 5.0;

  static double middle(const std::map<std::uint32_t, double>& seconds) {
    std::vector<double> values;
    for (const auto& [id, value] : seconds) values.push_back(value);
    return figures_of(std::move(values)).median_mm;
  }

  std::map<std::uint32_t, double> to_published_s_;
  std::map<std::uint32_t, double> to_converged_s_;
  std::vector<double> errors_mm_;
  double nees_ = 0.0;
};

// One published position beside the true one.
struct Compared {
  std::uint32_t id = 0;
  bool converged = false;
  Vector3d published;
  Vector3d truth;
  Matrix3d P_mm2;

  [[nodiscard]] double error_mm() const { return (published - truth).norm(); }
  [[nodiscard]] double nees() const {
    const Vector3d e = published - truth;
    return e.dot(P_mm2.ldlt().solve(e)) / 3.0;
  }
};

// What the samples say, taken in one after the other.
class Tally {
 public:
  Tally(const std::vector<double>& second_edges, const std::vector<double>& cycle_edges)
      : seconds_(second_edges), cycles_(cycle_edges) {}

  // `early`: released before a premature beat could be known.
  void begin_sample(double t_s, perimap_SurfaceState state, const ToldUses& uses, bool early) {
    t_s_ = t_s;
    uses_ = uses;
    for (std::size_t i = 0; i < uses.size(); ++i) {
      report_.uses[i].within_mm = uses[i].within_mm;
      report_.uses[i].surfaces += uses[i].state == perimap_SURFACE_GOOD ? 1 : 0;
    }
    good_ = state == perimap_SURFACE_GOOD;
    early_ = early;
    converged_ = 0;
    if (t_s < kSettledAfter_s) return;
    ++report_.settled_samples;
    report_.degraded += state == perimap_SURFACE_DEGRADED ? 1 : 0;
    report_.invalid += state == perimap_SURFACE_INVALID ? 1 : 0;
  }

  // Of the sample. True from the first in which the feature was converged.
  bool counts(std::uint32_t id, bool converged) {
    seen_.insert(id);
    if (converged) {
      ++converged_;
      converged_at_.try_emplace(id, t_s_);
    }
    return converged_at_.contains(id);
  }

  void add_without_truth(std::uint32_t id) { without_truth_.insert(id); }

  void add(const Compared& feature, bool on_path) {
    const double error = feature.error_mm();
    const double nees = feature.nees();
    seconds_.add_error(t_s_, error, nees);
    cycles_.add_error(t_s_, error, nees);
    feature_errors_[feature.id].push_back(error);
    if (feature.converged && good_) add_good(feature.id, error, nees);
    if (feature.converged) add_used(feature, error);
    if (t_s_ >= kSettledAfter_s) {
      settled_.push_back(error);
      nees_sum_ += nees;
    }
    if (on_path) {
      paths_[feature.id].published.push_back(feature.published);
      paths_[feature.id].truth.push_back(feature.truth);
    }
  }

  void end_sample() {
    if (t_s_ <= kSettledAfter_s) report_.converged_at_15_s = converged_;
    seconds_.add_sample(t_s_, converged_);
    cycles_.add_sample(t_s_, converged_);
  }

  // Of all samples; called once.
  [[nodiscard]] AccuracyReport report() {
    report_.features_published = seen_.size();
    report_.features_converged = converged_at_.size();
    report_.converged_by_15_s = static_cast<std::size_t>(std::count_if(
        converged_at_.begin(), converged_at_.end(), [](const auto& c) { return c.second <= kSettledAfter_s; }));
    report_.features_without_truth = without_truth_.size();
    report_.good.features_off = off_.size();
    if (report_.good.count > 0) {
      const auto count = static_cast<double>(report_.good.count);
      report_.good.rms_mm = std::sqrt(good_squares_ / count);
      report_.good.mean_nees = good_nees_sum_ / count;
    }
    report_.settled = figures_of(settled_);
    if (!settled_.empty()) {
      report_.mean_nees = nees_sum_ / static_cast<double>(settled_.size());
      const auto above = std::count_if(settled_.begin(), settled_.end(), [](double e) { return e > kOff_mm; });
      report_.share_above_3_mm = static_cast<double>(above) / static_cast<double>(settled_.size());
    }
    report_.seconds = seconds_.figures();
    report_.cycles = cycles_.figures();
    for (auto& [id, errors] : feature_errors_) {
      FeaturePath path = std::move(paths_[id]);
      path.id = id;
      path.error = figures_of(std::move(errors));
      report_.paths.push_back(std::move(path));
    }
    return std::move(report_);
  }

 private:
  void add_used(const Compared& feature, double error) {
    const double within_mm = 2.0 * std::sqrt(feature.P_mm2.trace());
    for (std::size_t i = 0; i < uses_.size(); ++i) {
      if (uses_[i].state != perimap_SURFACE_GOOD || within_mm > uses_[i].within_mm) continue;
      ++report_.uses[i].count;
      report_.uses[i].off += error > uses_[i].within_mm ? 1 : 0;
    }
  }

  void add_good(std::uint32_t id, double error, double nees) {
    GoodPositions& good = report_.good;
    ++good.count;
    good_squares_ += error * error;
    good_nees_sum_ += nees;
    double& largest = early_ ? good.largest_before_known_mm : good.largest_mm;
    largest = std::fmax(largest, error);
    if (error <= kOff_mm) return;
    ++(early_ ? good.off_before_known : good.off);
    if (!early_) off_.insert(id);
  }

  AccuracyReport report_;
  Spans seconds_;
  Spans cycles_;
  // Of the sample:
  double t_s_ = 0.0;
  bool good_ = false;
  bool early_ = false;
  ToldUses uses_{};
  std::size_t converged_ = 0;
  // Of all:
  std::set<std::uint32_t> seen_;
  std::map<std::uint32_t, double> converged_at_;
  std::map<std::uint32_t, std::vector<double>> feature_errors_;
  std::map<std::uint32_t, FeaturePath> paths_;
  std::set<std::uint32_t> without_truth_;
  std::set<std::uint32_t> off_;
  std::vector<double> settled_;
  double nees_sum_ = 0.0;
  double good_squares_ = 0.0;
  double good_nees_sum_ = 0.0;
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
  // Surfaces that the clock releases repeat a frame's, which does not tell.
  frames_.add(from_ns(sample.capture_time_ns));
  samples_.push_back({from_ns(sample.valid_time_ns), from_ns(sample.release_time_ns), sample.state, sample.reason,
                      uses_of(sample).value_or(ToldUses{}), begin, published_.size()});
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
    const CameraTruth* camera = truth_.camera(first_observed);
    if (camera == nullptr) continue;
    CameraModel lens = camera_;
    if (camera->focal_px.minCoeff() > 0.0) {
      lens.fx = camera->focal_px.x(), lens.fy = camera->focal_px.y();
      lens.cx = camera->principal_px.x(), lens.cy = camera->principal_px.y();
    }
    Vector3d ray_C;
    if (!lens.unproject(origin.px, ray_C)) continue;
    if (const auto point = truth_.first_hit(camera->X_WC, ray_C, truth_.taken_at(first_observed)))
      points.emplace(id, *point);
  }
  return points;
}

bool Accuracy::before_premature_beat_is_known(Instant released) const {
  // And a fiftieth, for what the stamps are rounded by.
  const Duration frame = from_seconds(1.02 / frames_.rate().per_s());
  for (std::size_t i = 1; i < beats_.size(); ++i) {
    if (beats_[i].beat_class != BeatClass::kPremature) continue;
    if (released >= beats_[i - 1].time && released <= beats_[i].detected_at + frame) return true;
  }
  return false;
}

std::vector<JudgedSurface> Accuracy::judged(Duration to_recording) const {
  const auto points = resolve_origins(to_recording);
  std::set<std::uint32_t> once_converged;
  std::vector<JudgedSurface> all;
  all.reserve(samples_.size());
  for (const SampleRange& sample : samples_) {
    JudgedSurface surface;
    surface.released_s = to_seconds(sample.released + to_recording - first_frame_);
    surface.state = sample.state;
    surface.reason = sample.reason;
    surface.before_known = before_premature_beat_is_known(sample.released + to_recording);
    for (std::size_t i = sample.begin; i < sample.end; ++i) {
      const Published& feature = published_[i];
      if (feature.converged) once_converged.insert(feature.id);
      const auto point = points.find(feature.id);
      if (point == points.end() || !once_converged.contains(feature.id)) continue;
      const double error_mm =
          (feature.p_W_mm - truth_.position(point->second, sample.valid_time + to_recording)).norm();
      ++surface.once_converged;
      surface.once_converged_off += error_mm > kOff_mm ? 1 : 0;
      if (!feature.converged || sample.state != perimap_SURFACE_GOOD) continue;
      ++surface.good;
      surface.largest_good_mm = std::max(surface.largest_good_mm, error_mm);
      if (error_mm > kOff_mm) surface.good_ids_off.push_back(feature.id);
    }
    all.push_back(std::move(surface));
  }
  return all;
}

AccuracyReport Accuracy::report(Duration to_recording) const {
  if (samples_.empty()) return {};
  const auto points = resolve_origins(to_recording);
  const auto since_start = [this](Instant t) { return to_seconds(t - first_frame_); };
  const double end_s = since_start(samples_.back().valid_time + to_recording);

  std::vector<double> second_edges;
  for (int t = 0; t <= end_s + 1.0; ++t) second_edges.push_back(t);
  std::vector<double> cycle_edges;
  for (const Instant r : truth_.motion().r_peaks) {
    if (const double t = since_start(r); t >= 0.0 && t <= end_s) cycle_edges.push_back(t);
  }
  Tally tally(second_edges, cycle_edges);
  NewTally new_tally;
  for (const SampleRange& sample : samples_) {
    const Instant valid_time = sample.valid_time + to_recording;
    const double t = since_start(valid_time);
    tally.begin_sample(t, sample.state, sample.uses, before_premature_beat_is_known(sample.released + to_recording));
    for (std::size_t i = sample.begin; i < sample.end; ++i) {
      const Published& feature = published_[i];
      const auto origin = origins_.find(feature.id);
      const double seen_s = origin != origins_.end() ? since_start(origin->second.first_observed + to_recording) : 0.0;
      new_tally.add(feature.id, seen_s, t, feature.converged);
      if (!tally.counts(feature.id, feature.converged)) continue;
      const auto point = points.find(feature.id);
      if (point == points.end()) {
        tally.add_without_truth(feature.id);
        continue;
      }
      const Vector3d p_true = truth_.position(point->second, valid_time);
      const Compared compared{feature.id, feature.converged, feature.p_W_mm, p_true, feature.P_mm2};
      new_tally.add_error(seen_s, t, feature.converged, compared.error_mm(), compared.nees());
      tally.add(compared, t >= end_s - kPathLength_s);
    }
    tally.end_sample();
  }
  AccuracyReport report = tally.report();
  report.samples = samples_.size();
  report.new_features = new_tally.figures();
  report.good.premature_beats = static_cast<std::size_t>(std::count_if(
      beats_.begin(), beats_.end(), [](const RPeak& beat) { return beat.beat_class == BeatClass::kPremature; }));
  return report;
}

}  // namespace perimap
