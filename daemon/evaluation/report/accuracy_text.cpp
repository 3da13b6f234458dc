#include "daemon/evaluation/report/accuracy_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/evaluation/json/json_number.hpp"

namespace perimap {
namespace {

// A figure of nothing is not zero.
std::string plain(double value) { return std::isfinite(value) ? fmt::format("{:.2f}", value) : "none"; }

std::string in_mm(double value) { return std::isfinite(value) ? fmt::format("{:.2f} mm", value) : "none"; }

nlohmann::json to_json(const ErrorFigures& error) {
  return {{"count", error.count},
          {"rms_mm", json_number(error.rms_mm)},
          {"median_mm", json_number(error.median_mm)},
          {"p95_mm", json_number(error.p95_mm)},
          {"max_mm", json_number(error.max_mm)}};
}

nlohmann::json to_json(const std::vector<ErrorSpan>& spans) {
  nlohmann::json out = nlohmann::json::array();
  for (const ErrorSpan& span : spans) {
    out.push_back({{"begin_s", span.begin_s},
                   {"end_s", span.end_s},
                   {"converged", span.converged},
                   {"mean_nees", json_number(span.mean_nees)},
                   {"error", to_json(span.error)}});
  }
  return out;
}

nlohmann::json to_json(const UsedPositions& used) {
  return {{"within_mm", used.within_mm}, {"surfaces", used.surfaces}, {"positions", used.count}, {"off", used.off}};
}

nlohmann::json to_json(const NewFeatures& features) {
  return {{"published", features.published},
          {"converged", features.converged},
          {"to_published_s", json_number(features.to_published_s)},
          {"to_converged_s", json_number(features.to_converged_s)},
          {"young_error", to_json(features.young)},
          {"young_mean_nees", json_number(features.young_nees)}};
}

}  // namespace

std::string to_text(const AccuracyReport& report) {
  const auto& [show, measure, contact] = report.uses;
  if (report.settled.count == 0) {
    return fmt::format(
        "features    {} mapped, {} converged, {} without truth\nerror       none: no converged position after 15 s",
        report.features_published, report.features_converged, report.features_without_truth);
  }
  return fmt::format(
      "features    {} mapped, {} converged, {} of them within 15 s ({} at 15 s), {} without truth\n"
      "error       RMS {:.3f} mm, median {:.2f} mm, 95th percentile {:.2f} mm, largest {:.2f} mm, above 3 mm {:.1f} %\n"
      "            ({} positions at their valid time, 15 s to the end, every feature once called converged)\n"
      "consistency mean NEES/3 {:.2f} (1 is consistent, below is cautious)\n"
      "states      {} of {} surfaces degraded, {} invalid, from 15 s on\n"
      "good        {} of {} positions of state good off by more than 3 mm, largest {}, of {} features\n"
      "            all of state good: RMS {}, mean NEES/3 {}\n"
      "            {} more, largest {}, before the ECG could tell of the premature beat that ended their cycle "
      "({} such beats)\n"
      "uses        to show {} of {} positions off by more than {:g} mm, to measure {} of {} by more than {:g} mm, "
      "in contact {} of {} by more than {:g} mm",
      report.features_published, report.features_converged, report.converged_by_15_s, report.converged_at_15_s,
      report.features_without_truth, report.settled.rms_mm, report.settled.median_mm, report.settled.p95_mm,
      report.settled.max_mm, 100.0 * report.share_above_3_mm, report.settled.count, report.mean_nees, report.degraded,
      report.settled_samples, report.invalid, report.good.off, report.good.count, in_mm(report.good.largest_mm),
      report.good.features_off, in_mm(report.good.rms_mm), plain(report.good.mean_nees), report.good.off_before_known,
      in_mm(report.good.largest_before_known_mm), report.good.premature_beats, show.off, show.count, show.within_mm,
      measure.off, measure.count, measure.within_mm, contact.off, contact.count, contact.within_mm);
}

nlohmann::json to_json(const AccuracyReport& report) {
  nlohmann::json features = nlohmann::json::array();
  for (const FeaturePath& path : report.paths) features.push_back({{"id", path.id}, {"error", to_json(path.error)}});
  return {{"samples", report.samples},
          {"features_mapped", report.features_published},
          {"features_converged", report.features_converged},
          {"features_converged_by_15_s", report.converged_by_15_s},
          {"features_converged_at_15_s", report.converged_at_15_s},
          {"features_without_truth", report.features_without_truth},
          {"settled_error", to_json(report.settled)},
          {"settled_mean_nees", json_number(report.mean_nees)},
          {"settled_share_above_3_mm", json_number(report.share_above_3_mm)},
          {"surfaces_settled", report.settled_samples},
          {"surfaces_degraded", report.degraded},
          {"surfaces_invalid", report.invalid},
          {"good_positions", report.good.count},
          {"good_positions_off", report.good.off},
          {"good_positions_off_before_known", report.good.off_before_known},
          {"good_positions_rms_mm", json_number(report.good.rms_mm)},
          {"good_positions_mean_nees", json_number(report.good.mean_nees)},
          {"premature_beats", report.good.premature_beats},
          {"uses",
           {{"display", to_json(report.uses[0])},
            {"measure", to_json(report.uses[1])},
            {"contact", to_json(report.uses[2])}}},
          {"new_features", to_json(report.new_features)},
          {"seconds", to_json(report.seconds)},
          {"cycles", to_json(report.cycles)},
          {"features", features}};
}

}  // namespace perimap
