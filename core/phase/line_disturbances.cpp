#include "core/phase/line_disturbances.hpp"

namespace perimap {

void LineDisturbances::note(Instant t, double weight) noexcept {
  count_ = std::min(at(t) + weight, settings_.most_disturbances);
  last_at_ = std::max(t, last_at_);
}

double LineDisturbances::at(Instant t) const noexcept {
  return count_ * std::exp(-std::max(to_seconds(t - last_at_), 0.0) / settings_.disturbance_memory_s);
}

bool LineDisturbances::unlike_any_beat(const QrsCandidate& candidate) const noexcept {
  return candidate.step > settings_.most_step ||
         candidate.rough - levels_.usual_roughness() > settings_.most_rough * candidate.energy;
}

}  // namespace perimap
