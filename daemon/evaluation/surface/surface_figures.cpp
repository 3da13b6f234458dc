#include "daemon/evaluation/surface/surface_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/evaluation/json/json_number.hpp"

namespace perimap {
namespace {

constexpr double kSettledAfter_s = 15.0;
constexpr double kCovered = 0.9;

double root_mean(double squares, std::size_t count) {
  return count == 0 ? kNoFigure : std::sqrt(squares / static_cast<double>(count));
}

double p95_of(std::vector<float> errors) {
  if (errors.empty()) return kNoFigure;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(0.95 * static_cast<double>(errors.size()))) - 1;
  std::nth_element(errors.begin(), errors.begin() + rank, errors.end());
  return errors[static_cast<std::size_t>(rank)];
}

SurfaceFigures::Compared compared(const std::vector<float>& errors) {
  double squares = 0.0;
  for (const float error : errors) squares += static_cast<double>(error) * static_cast<double>(error);
  return {root_mean(squares, errors.size()), p95_of(errors)};
}

nlohmann::json to_json(const SurfaceFigures::Compared& figures) {
  return {{"rms_mm", json_number(figures.rms_mm)}, {"p95_mm", json_number(figures.p95_mm)}};
}

std::string plain(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "none";
}

}  // namespace

void SurfaceTally::begin_instant(double t_s) {
  t_s_ = t_s;
  settled_ = t_s >= kSettledAfter_s;
  seen_ = 0;
  supported_ = 0;
  seen_at_all_ = 0;
  supported_at_all_ = 0;
}

void SurfaceTally::add_seen(bool supported, bool well) {
  ++seen_at_all_;
  supported_at_all_ += supported ? 1 : 0;
  if (!well) return;
  ++seen_;
  supported_ += supported ? 1 : 0;
}

void SurfaceTally::end_instant() {
  if (seen_ == 0) return;
  const double share = static_cast<double>(supported_) / static_cast<double>(seen_);
  if (share >= kCovered && !std::isfinite(time_to_90_percent_s_)) time_to_90_percent_s_ = t_s_;
  if (!settled_) return;
  ++instants_;
  coverages_ += share;
  coverages_at_any_angle_ += static_cast<double>(supported_at_all_) / static_cast<double>(seen_at_all_);
}

void SurfaceTally::add(std::size_t horizon, const Error& error) {
  if (!settled_) return;
  const double square = error.error_mm * error.error_mm;
  if (error.on_rim) {
    if (horizon != 0) return;
    rim_.squares += square;
    rim_.nees += error.nees;
    ++rim_.count;
    return;
  }
  Sums& sums = horizons_[horizon];
  sums.squares += square;
  sums.nees += error.nees;
  ++sums.count;
  if (horizon != 0) return;
  errors_mm_.push_back(static_cast<float>(error.error_mm));
  if (error.point >= scored_.size()) scored_.resize(error.point + 1, false);
  scored_[error.point] = true;
}

void SurfaceTally::add_compared(double gaussian_process_mm, double barycentric_mm, double thin_plate_mm) {
  if (!settled_) return;
  compared_mm_[0].push_back(static_cast<float>(gaussian_process_mm));
  compared_mm_[1].push_back(static_cast<float>(barycentric_mm));
  compared_mm_[2].push_back(static_cast<float>(thin_plate_mm));
}

SurfaceFigures SurfaceTally::figures() const {
  SurfaceFigures figures;
  figures.instants = instants_;
  figures.points = static_cast<std::size_t>(std::count(scored_.begin(), scored_.end(), true));
  for (std::size_t h = 0; h < horizons_.size(); ++h) {
    const Sums& sums = horizons_[h];
    figures.horizons[h].rms_mm = root_mean(sums.squares, sums.count);
    if (sums.count > 0) figures.horizons[h].nees = sums.nees / static_cast<double>(sums.count);
  }
  figures.p95_mm = p95_of(errors_mm_);
  figures.rim_rms_mm = root_mean(rim_.squares, rim_.count);
  if (rim_.count > 0) figures.rim_nees = rim_.nees / static_cast<double>(rim_.count);
  if (instants_ > 0) {
    figures.coverage = coverages_ / static_cast<double>(instants_);
    figures.coverage_at_any_angle = coverages_at_any_angle_ / static_cast<double>(instants_);
  }
  figures.time_to_90_percent_s = time_to_90_percent_s_;
  figures.gaussian_process = compared(compared_mm_[0]);
  figures.barycentric = compared(compared_mm_[1]);
  figures.thin_plate = compared(compared_mm_[2]);
  return figures;
}

nlohmann::json to_json(const SurfaceFigures& figures) {
  nlohmann::json json = {{"instants", figures.instants},
                         {"points", figures.points},
                         {"rms_mm", json_number(figures.horizons[0].rms_mm)},
                         {"p95_mm", json_number(figures.p95_mm)},
                         {"nees", json_number(figures.horizons[0].nees)},
                         {"rim_rms_mm", json_number(figures.rim_rms_mm)},
                         {"rim_nees", json_number(figures.rim_nees)},
                         {"coverage", json_number(figures.coverage)},
                         {"coverage_at_any_angle", json_number(figures.coverage_at_any_angle)},
                         {"time_to_90_percent_s", json_number(figures.time_to_90_percent_s)},
                         {"inside",
                          {{"gaussian_process", to_json(figures.gaussian_process)},
                           {"barycentric", to_json(figures.barycentric)},
                           {"thin_plate", to_json(figures.thin_plate)}}},
                         {"agreement_rms_mm", json_number(figures.agreement_rms_mm)},
                         {"agreement_nees", json_number(figures.agreement_nees)},
                         {"features", figures.features},
                         {"features_contradicted", figures.contradicted},
                         {"features_begun", figures.begun},
                         {"features_contradicting", figures.contradicting},
                         {"model", to_json(figures.model)},
                         {"refusal", figures.refusal}};
  for (std::size_t h = 1; h < kSurfaceHorizons_ms.size(); ++h) {
    json[fmt::format("rms_{}_ms_mm", kSurfaceHorizons_ms[h])] = json_number(figures.horizons[h].rms_mm);
    json[fmt::format("nees_{}_ms", kSurfaceHorizons_ms[h])] = json_number(figures.horizons[h].nees);
  }
  return json;
}

std::string to_text(const SurfaceFigures& figures) {
  if (figures.instants == 0 || figures.points == 0) {
    return fmt::format("surface     none from 15 s on{}{}", figures.refusal.empty() ? "" : ": ", figures.refusal);
  }
  const std::string model = to_text(figures.model);
  return fmt::format(
      "surface     RMS {} mm, 95th percentile {} mm, NEES/3 {} ({} points seen well, not on the rim; {} instants from "
      "15 s "
      "on)\n"
      "            rim of 5 mm, and beyond it: RMS {} mm, NEES/3 {}; {} ms ahead {} mm, {} ms ahead {} mm\n"
      "            coverage {} of what was seen at 60 degrees at most, {} of what was seen at all; 90 % after {} s\n"
      "            within the features: Gaussian process {} (95 % {}), thin plate {} ({}), barycentric {} ({}) mm\n"
      "            leave one out: RMS {} mm, normalised {} ({} features, {} contradict their neighbours){}{}",
      plain(figures.horizons[0].rms_mm, 3), plain(figures.p95_mm, 2), plain(figures.horizons[0].nees, 2),
      figures.points, figures.instants, plain(figures.rim_rms_mm, 3), plain(figures.rim_nees, 1),
      kSurfaceHorizons_ms[1], plain(figures.horizons[1].rms_mm, 3), kSurfaceHorizons_ms[2],
      plain(figures.horizons[2].rms_mm, 3), plain(figures.coverage, 3), plain(figures.coverage_at_any_angle, 3),
      plain(figures.time_to_90_percent_s, 0), plain(figures.gaussian_process.rms_mm, 3),
      plain(figures.gaussian_process.p95_mm, 2), plain(figures.thin_plate.rms_mm, 3),
      plain(figures.thin_plate.p95_mm, 2), plain(figures.barycentric.rms_mm, 3), plain(figures.barycentric.p95_mm, 2),
      plain(figures.agreement_rms_mm, 3), plain(figures.agreement_nees, 2), figures.features, figures.contradicted,
      model.empty() ? "" : "\n            ", model);
}

}  // namespace perimap
