#include "daemon/evaluation/experiment/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "daemon/evaluation/experiment/accuracy_figures.hpp"

namespace perimap {
namespace {

// Processor time of this thread: what else the machine does is not the method's.
double processor_ns() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

}  // namespace

Comparison::Comparison(std::vector<MethodKind> kinds, const BasisLayout& layout, const Prior& prior,
                       double first_depth_mm, double interval_s, const MethodOptions& options)
    : kinds_(std::move(kinds)),
      setting_{nullptr, layout, prior, first_depth_mm},
      interval_s_(interval_s),
      options_(options) {}

void Comparison::add(const Scene& scene) {
  frame_s_ = 1.0 / scene.settings.frames_per_s;
  setting_.scene = &scene;
  for (const SceneFeature& feature : scene.features) {
    if (static_cast<int>(feature.sightings.size()) < options_.buffered) continue;
    add_feature(scene, feature);
    add_bound(scene, feature);
  }
  setting_.scene = nullptr;
}

void Comparison::add_feature(const Scene& scene, const SceneFeature& feature) {
  std::vector<double> static_innovations;
  for (const MethodKind kind : kinds_) {
    Figures& figures = figures_[method_name(kind)];
    const auto method = make_method(kind, setting_, options_);
    int next = 1;  // interval
    for (std::size_t k = 0; k < feature.sightings.size(); ++k) {
      const Sighting& sighting = feature.sightings[k];
      const double begin_ns = processor_ns();
      method->observe(sighting);
      figures.taken_ns += processor_ns() - begin_ns;
      if (kind == MethodKind::kStaticEkf) {
        static_innovations.push_back(method->last_innovation());
      } else if (k < static_innovations.size() && std::isfinite(method->last_innovation())) {
        auto& [sum, count] = figures.differences[static_cast<int>(k)];
        sum += static_innovations[k] - method->last_innovation();
        ++count;
      }
      const double time_s = (sighting.frame + 1) * frame_s_;
      if (kind == MethodKind::kBatch || time_s < next * interval_s_ - 1e-9) continue;
      if (const FeatureEstimate* estimate = method->estimate(); estimate != nullptr) {
        const int interval = static_cast<int>(std::floor(time_s / interval_s_ + 1e-9));
        figures.errors_over_time_mm[interval].push_back(path_error_mm(*estimate, method->layout(), scene, feature));
      }
      next = static_cast<int>(std::floor(time_s / interval_s_ + 1e-9)) + 1;
    }
    figures.sightings += static_cast<double>(feature.sightings.size());
    const double begin_ns = processor_ns();
    const FeatureEstimate* estimate = method->estimate();
    figures.taken_ns += processor_ns() - begin_ns;
    if (estimate == nullptr) {
      figures.errors_mm.push_back(std::numeric_limits<double>::infinity());
      continue;
    }
    figures.errors_mm.push_back(path_error_mm(*estimate, method->layout(), scene, feature));
    figures.nees.push_back(normalised_squared_error(*estimate, method->layout(), scene, feature));
  }
}

void Comparison::add_bound(const Scene& scene, const SceneFeature& feature) {
  Figures& figures = figures_[kBound];
  const int frames = feature.sightings.back().frame + 1;
  const auto deviation = [&](int end_frame) {
    return path_deviation_mm(cramer_rao_bound(scene, feature, setting_.layout, setting_.prior, end_frame),
                             setting_.layout);
  };
  for (int interval = 1; interval * interval_s_ <= frames * frame_s_ + 1e-9; ++interval) {
    const int end_frame = static_cast<int>(std::lround(interval * interval_s_ / frame_s_));
    figures.errors_over_time_mm[interval].push_back(deviation(end_frame));
  }
  figures.errors_mm.push_back(deviation(frames));
}

std::vector<MethodRow> Comparison::rows() const {
  std::vector<std::string> names;
  for (const MethodKind kind : kinds_) names.push_back(method_name(kind));
  names.emplace_back(kBound);
  std::vector<MethodRow> rows;
  for (const std::string& name : names) {
    const auto found = figures_.find(name);
    if (found == figures_.end()) continue;
    const Figures& figures = found->second;
    MethodRow row;
    row.method = name;
    row.features = static_cast<int>(figures.errors_mm.size());
    row.median_mm = quantile(figures.errors_mm, 0.5);
    row.p95_mm = quantile(figures.errors_mm, 0.95);
    row.worst_mm = quantile(figures.errors_mm, 1.0);
    row.share_above_2_mm = static_cast<double>(std::count_if(figures.errors_mm.begin(), figures.errors_mm.end(),
                                                             [](double e) { return e > kLostError_mm; })) /
                           static_cast<double>(std::max<std::size_t>(figures.errors_mm.size(), 1));
    double sum = 0.0;
    for (const double nees : figures.nees) sum += nees;
    row.mean_nees = sum / static_cast<double>(figures.nees.size());  // NaN without any
    row.us_per_update = 1e-3 * figures.taken_ns / figures.sightings;
    rows.push_back(row);
  }
  return rows;
}

std::vector<Comparison::CurvePoint> Comparison::curve(const std::string& method) const {
  std::vector<CurvePoint> points;
  const auto found = figures_.find(method);
  if (found == figures_.end()) return points;
  for (const auto& [interval, errors] : found->second.errors_over_time_mm)
    points.push_back({interval * interval_s_, quantile(errors, 0.5)});
  return points;
}

std::vector<Comparison::InnovationPoint> Comparison::innovation_difference(MethodKind kind) const {
  std::vector<InnovationPoint> points;
  const auto found = figures_.find(method_name(kind));
  if (found == figures_.end()) return points;
  for (const auto& [k, sum_and_count] : found->second.differences)
    points.push_back({k * frame_s_, sum_and_count.first / sum_and_count.second});
  return points;
}

}  // namespace perimap
