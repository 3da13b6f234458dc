#include "core/phase/candidate_finder.hpp"

#include <algorithm>

namespace perimap {

void CandidateFinder::restart() noexcept {
  rising_ = true;
  crest_ = 0.0;
  crest_at_ = 0;
  trough_ = 0.0;
  crest_count_ = 0;
  best_fit_.of = -1;
}

// True when a local maximum of the energy, at crest_at_, has just been confirmed.
bool CandidateFinder::follow_energy() noexcept {
  const double energy = filter_.at(filter_.now()).energy;
  if (!rising_) {
    trough_ = std::min(trough_, energy);
    if (energy <= settings_.rise_again * trough_) return false;
    rising_ = true;
    crest_ = energy;
    crest_at_ = filter_.now();
    return false;
  }
  if (energy > crest_) {
    crest_ = energy;
    crest_at_ = filter_.now();
  }
  const bool confirmed =
      energy < settings_.confirm_fall * crest_ || filter_.now() - crest_at_ >= filter_.samples_in(settings_.confirm);
  if (!confirmed || !(crest_ > 0.0)) return false;
  rising_ = false;
  trough_ = energy;
  return true;
}

// The matched filter at the newest instant whose surroundings are known; gives a maximum of the correlation that has
// been passed.
std::optional<CandidateFinder::Fit> CandidateFinder::follow_templates(const QrsClusters& clusters) noexcept {
  Fit fit;
  fit.at = filter_.now() - filter_.slope_delay() - meter_.points_after() * meter_.step();
  if (fit.at < 0) return std::nullopt;
  const ClusterMatch match = clusters.nearest_beat(meter_.shape_at(fit.at));
  fit.correlation = match.correlation;
  fit.of = match.of;
  if (fit.correlation >= settings_.alike && (best_fit_.of < 0 || fit.correlation > best_fit_.correlation)) {
    best_fit_ = fit;
    return std::nullopt;
  }
  if (best_fit_.of < 0 || fit.at - best_fit_.at < settings_.fit_confirm * meter_.step()) return std::nullopt;
  const Fit passed = best_fit_;
  best_fit_.of = -1;
  return passed;
}

}  // namespace perimap
