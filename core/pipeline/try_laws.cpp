#include "core/pipeline/try_laws.hpp"

#include <cmath>
#include <span>
#include <vector>

#include "core/phase/seconds.hpp"
#include "core/pipeline/phase_basis.hpp"

namespace perimap {
namespace {

// `observation` as the law has it. Its phase is taken for as uncertain as both R peaks are, whatever the law makes of
// them, so that none gains by being less sure.
void retell(Observation& observation, const ObservedCycle& observed, const PhaseLawSettings& law, Instant capture,
            const BasisLayout& layout) {
  const CardiacCycle& cycle = observed.cycle;
  const CyclePhase phase = phase_in_cycle(law, Seconds(capture - cycle.begin), cycle.length, cycle.previous_length);
  const double deviation_s = std::hypot(to_seconds(cycle.begin_deviation), to_seconds(cycle.length_deviation));
  observation.b = basis_at(layout, phase.phase_rad, observed.respiration);
  observation.b_deviation = basis_rate(layout, phase.phase_rad) * (phase.rate_rad_per_s * deviation_s);
}

}  // namespace

std::optional<LawTrial> try_laws(const BatchStartExchange& start, const PixelModel& model, const BasisLayout& layout,
                                 const Prior& prior, const BatchSettings& settings) {
  const std::span<const Observation> told(start.observations.data(), static_cast<std::size_t>(start.count));
  for (std::size_t k = 0; k < told.size(); ++k) {
    if (start.cycles[k].respiration.deviation_mm > 0.0) return std::nullopt;
  }
  BatchSettings from_outcome = settings;
  if (start.outcome.ok()) {
    // The depth hardly depends on the law.
    const Observation& first = told.front();
    from_outcome.start_depths_mm = {(first.X_CW * start.outcome.estimate.position(first.b)).norm()};
  }
  LawTrial trial;
  trial.begin = start.captures.front();
  trial.end = start.captures[static_cast<std::size_t>(start.count - 1)];
  std::vector<Observation> observations(told.begin(), told.end());
  bool explained = false;
  for (const PhaseLaw law : kPhaseLaws) {
    const PhaseLawSettings tried = start.law.with(law);
    for (std::size_t k = 0; k < observations.size(); ++k)
      retell(observations[k], start.cycles[k], tried, start.captures[k], layout);
    const BatchOutcome outcome =
        batch_start(std::span<const Observation>(observations), model, layout, prior, from_outcome);
    if (!outcome.ok() && outcome.status != BatchStatus::kTooManyOutliers) return std::nullopt;
    trial.costs[index_of(law)] = outcome.robust_cost;
    explained = explained || !outcome.contradicted();
  }
  if (!explained) return std::nullopt;
  return trial;
}

}  // namespace perimap
