#include "core/phase/r_trigger.hpp"

#include <algorithm>

namespace perimap {

std::optional<RPeak> RTrigger::push(Instant pulse, Instant arrival) noexcept {
  if (has_last_ && pulse - last_ < settings_.refractory) return std::nullopt;
  has_last_ = true;
  last_ = pulse;
  RPeak peak;
  peak.time = pulse - settings_.delay;
  peak.detected_at = std::max(arrival, peak.time);
  peak.confidence = 1.0;
  peak.deviation = settings_.deviation;
  return peak;
}

}  // namespace perimap
