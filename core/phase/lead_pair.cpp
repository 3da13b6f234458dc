#include "core/phase/lead_pair.hpp"

#include <cmath>
#include <limits>

namespace perimap {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

LeadBeat of_one_lead(const RPeak& peak) noexcept { return {peak, 0, {peak.shape, QrsShape{}}}; }

}  // namespace

EcgSignal LeadPair::signal() const noexcept {
  return two_ && rank(signal(1)) > rank(signal(0)) ? signal(1) : signal(0);
}

std::optional<LeadBeat> LeadPair::push(Instant t, float mV) noexcept {
  if (two_) return push(t, mV, kNone);
  const std::optional<RPeak> peak = detectors_[0].push(t, mV);
  interruptions_ = detectors_[0].interruptions();
  if (!peak) return std::nullopt;
  return of_one_lead(*peak);
}

std::optional<LeadBeat> LeadPair::push(Instant t, float first_mV, float second_mV) noexcept {
  if (!two_ && std::isfinite(second_mV)) {
    two_ = true;
    interrupted_ = {detectors_[0].interruptions(), detectors_[1].interruptions()};
  }
  if (!two_) return push(t, first_mV);
  const std::array<std::optional<RPeak>, 2> peaks{detectors_[0].push(t, first_mV), detectors_[1].push(t, second_mV)};
  hear(t);
  for (int lead = 0; lead < 2; ++lead) {
    if (const auto& peak = peaks[static_cast<std::size_t>(lead)]) agreement_.hear(lead, *peak);
  }
  return decide(false);
}

void LeadPair::lead_off(Instant t) noexcept {
  detectors_[0].lead_off(t);
  if (!two_) {
    interruptions_ = detectors_[0].interruptions();
    return;
  }
  detectors_[1].lead_off(t);
  hear(t);
}

std::optional<LeadBeat> LeadPair::flush() noexcept {
  if (!two_) {
    const std::optional<RPeak> peak = detectors_[0].flush();
    if (!peak) return std::nullopt;
    return of_one_lead(*peak);
  }
  for (int lead = 0; lead < 2; ++lead) {
    while (const auto peak = detectors_[static_cast<std::size_t>(lead)].flush()) agreement_.hear(lead, *peak);
  }
  return decide(true);
}

// What each lead is good for, and whether none is heard any more.
void LeadPair::hear(Instant t) noexcept {
  agreement_.hear(t, {signal(0), signal(1)});
  bool broken = false;
  for (std::size_t lead = 0; lead < 2; ++lead) {
    broken = broken || detectors_[lead].interruptions() != interrupted_[lead];
    interrupted_[lead] = detectors_[lead].interruptions();
  }
  if (broken && !agreement_.usable(0) && !agreement_.usable(1)) ++interruptions_;
}

std::optional<LeadBeat> LeadPair::decide(bool ending) noexcept {
  return agreement_.decide(ending, [&](int lead, Instant t, Duration near) {
    return detectors_[static_cast<std::size_t>(lead)].ponders(t, near);
  });
}

}  // namespace perimap
