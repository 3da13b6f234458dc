#include "horizon_session.hpp"

#include <fmt/format.h>

#include <cmath>

#include "motion_laws.hpp"

namespace perimap::test {

double HorizonErrors::Span::rms_mm() const { return positions > 0.0 ? std::sqrt(square_sum_mm2 / positions) : NAN; }

double HorizonErrors::rms_from(std::size_t span) const {
  Span sum;
  for (; span < spans.size(); ++span) {
    sum.positions += spans[span].positions;
    sum.square_sum_mm2 += spans[span].square_sum_mm2;
  }
  return sum.rms_mm();
}

std::vector<double> HorizonErrors::rms_by_span() const {
  std::vector<double> all;
  for (const Span& span : spans) all.push_back(span.rms_mm());
  return all;
}

HorizonSession::HorizonSession(const Simulation& simulation, const PipelineSettings& settings,
                               const std::vector<Duration>& horizons)
    : start_(simulation.frames().front().stamp.capture),
      law_(settings.clock.law.law),
      pipeline_(std::make_unique<Pipeline>(settings)) {
  for (const Duration lead : horizons) {
    ComposerSettings composer;
    composer.layout = settings.estimator.layout;
    composer.lead = lead;
    composer.maximum_features = static_cast<std::size_t>(settings.features.maximum);
    ahead_.push_back(std::make_unique<Ahead>(composer, simulation.truth(), settings.camera, start_));
  }
  runtime_ = std::make_unique<LockstepRuntime>(*pipeline_, Identity{}, Duration(0), *this);
}

void HorizonSession::surface(const perimap_Surface& sample) {
  const Release release{sample.frame_sequence, from_ns(sample.capture_time_ns), from_ns(sample.release_time_ns),
                        sample.reason == perimap_SURFACE_REASON_FRAME_MISSING};
  const CardiacClock clock = pipeline_->status_clock(release.deadline);
  if (clock.law().law != law_) {
    law_ = clock.law().law;
    law_changed_s_ = to_seconds(release.deadline - start_);
  }
  const RespiratoryClock respiration = pipeline_->status_respiration();
  const auto snapshots = pipeline_->model_snapshots();
  for (const auto& ahead : ahead_) {
    ahead->accuracy.add(ahead->wire.fill(ahead->composer.compose(release, clock, respiration, snapshots), {}));
  }
}

void HorizonSession::surface_model(const perimap_SurfaceModel& model) {
  for (const auto& ahead : ahead_) ahead->accuracy.add(model);
}

std::vector<HorizonErrors> HorizonSession::errors() const {
  std::vector<HorizonErrors> all;
  for (const auto& ahead : ahead_) {
    const AccuracyReport report = ahead->accuracy.report(Duration(0));
    HorizonErrors errors;
    errors.rms_mm = report.settled.rms_mm;
    errors.nees = report.mean_nees;
    errors.good = report.good;
    for (const ErrorSpan& second : report.seconds) {
      const auto at = static_cast<std::size_t>(second.begin_s / HorizonErrors::kSpan_s);
      if (at >= errors.spans.size()) errors.spans.resize(at + 1);
      const auto positions = static_cast<double>(second.error.count);
      if (second.error.count == 0) continue;
      errors.spans[at].positions += positions;
      errors.spans[at].square_sum_mm2 += positions * second.error.rms_mm * second.error.rms_mm;
    }
    all.push_back(std::move(errors));
  }
  return all;
}

std::string HorizonSession::description() const {
  const std::string changed = law_changed_s_ ? fmt::format(" after {:.0f} s", *law_changed_s_) : "";
  return fmt::format("{} features, law {}{}", ahead_.front()->accuracy.report(Duration(0)).features_converged,
                     name_of(law_), changed);
}

}  // namespace perimap::test
