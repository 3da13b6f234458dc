#include "core/phase/lead_agreement.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kSurest = 0.995;        // no lead is as sure as to rule the other out
constexpr double kCycleMemory = 8.0;     // beats
constexpr double kLongestCycle_s = 3.0;  // what is longer is a gap, not the first cycle
constexpr int kOffsetKnownAfter = 8;     // beats

Duration distance(Instant a, Instant b) noexcept { return a > b ? a - b : b - a; }

}  // namespace

// In a burst that both leads have, each is called good now and then.
bool LeadAgreement::good(int lead) const noexcept {
  return of(lead).signal == EcgSignal::kGood && newest_ - of(lead).disturbed_at >= settings_.calm;
}

bool LeadAgreement::usable(int lead) const noexcept { return rank(of(lead).signal) >= rank(EcgSignal::kNoisy); }

void LeadAgreement::hear(Instant now, const std::array<EcgSignal, 2>& signals) noexcept {
  const double step_s = started_ && now > newest_ ? to_seconds(now - newest_) : 0.0;
  const double rate = std::min(step_s / settings_.heard_s, 1.0);
  started_ = true;
  newest_ = std::max(now, newest_);
  for (int lead = 0; lead < 2; ++lead) {
    Lead& l = of(lead);
    l.signal = signals[static_cast<std::size_t>(lead)];
    if (l.signal != EcgSignal::kGood) l.disturbed_at = newest_;
    const double heard = good(lead) ? 1.0 : usable(lead) ? settings_.noisy : 0.0;
    l.heard += (heard - l.heard) * rate;
  }
  const int other = 1 - leading_;
  const bool better = of(other).worth() > settings_.better * of(leading_).worth();
  if (usable(other) && (better || !usable(leading_))) leading_ = other;
}

void LeadAgreement::hear(int lead, const RPeak& peak) noexcept {
  const auto at = static_cast<std::size_t>(lead);
  const Instant time = lead == 0 ? peak.time : peak.time - from_seconds(offset_s_);
  if (join_told(lead, peak, time)) return;
  for (int i = 0; i < pending_count_; ++i) {
    Pending& pending = pending_[static_cast<std::size_t>(i)];
    if (pending.in[at] || distance(pending.time, time) > settings_.one_beat) continue;
    pending.in[at] = true;
    pending.peaks[at] = peak;
    learn_offset(pending.peaks[0].time, pending.peaks[1].time);
    return;
  }
  if (pending_count_ == kPending) return;
  int place = pending_count_;
  for (; place > 0 && pending_[static_cast<std::size_t>(place - 1)].time > time; --place) {
    pending_[static_cast<std::size_t>(place)] = pending_[static_cast<std::size_t>(place - 1)];
  }
  Pending& pending = pending_[static_cast<std::size_t>(place)];
  pending = Pending{};
  pending.time = time;
  pending.known_at = newest_;
  pending.in[at] = true;
  pending.peaks[at] = peak;
  ++pending_count_;
}

// A beat that has been told already, which this lead was long in doubt about.
bool LeadAgreement::join_told(int lead, const RPeak& peak, Instant time) noexcept {
  const auto at = static_cast<std::size_t>(lead);
  for (int i = 0; i < told_count_; ++i) {
    Told& told = told_[static_cast<std::size_t>(i)];
    if (told.in[at] || distance(told.time, time) > settings_.one_beat) continue;
    told.in[at] = true;
    told.confidence[at] = peak.confidence;
    return true;
  }
  return false;
}

// Their mean at first; then by so little a beat that those of another origin, which differ, hardly count.
void LeadAgreement::learn_offset(Instant first, Instant second) noexcept {
  const double off_s = to_seconds(second - first) - offset_s_;
  offsets_ = std::min(offsets_ + 1, static_cast<int>(settings_.beats));
  const double step_s = off_s / offsets_;
  const bool known = offsets_ > kOffsetKnownAfter;
  offset_s_ += known ? std::clamp(step_s, -settings_.largest_shift_s, settings_.largest_shift_s) : step_s;
}

void LeadAgreement::drop_first() noexcept {
  std::copy(pending_.begin() + 1, pending_.begin() + pending_count_, pending_.begin());
  --pending_count_;
}

bool LeadAgreement::is_early(const Pending& pending) const noexcept {
  if (told_count_ == 0 || cycle_s_ <= 0.0) return false;
  const Instant last = told_[static_cast<std::size_t>(told_count_ - 1)].time;
  return to_seconds(pending.time - last) < settings_.early * cycle_s_;
}

LeadAgreement::Verdict LeadAgreement::verdict(const Pending& pending, bool ending, Pondered other,
                                              double& probability) const noexcept {
  if (told_count_ > 0 && pending.time - told_[static_cast<std::size_t>(told_count_ - 1)].time < settings_.refractory) {
    return Verdict::kPassOver;
  }
  if (!pending.of_both()) return verdict_of_one(pending, ending, other, probability);
  probability = probability_of_both(pending);
  return Verdict::kTell;
}

double LeadAgreement::probability_of_both(const Pending& pending) const noexcept {
  const double first = pending.peaks[0].confidence;
  const double second = pending.peaks[1].confidence;
  if (good(0) && good(1)) return std::max(first, second);
  const int heard = good(0) == good(1) ? leading_ : good(0) ? 0 : 1;
  return heard == 0 ? first : second;
}

LeadAgreement::Verdict LeadAgreement::verdict_of_one(const Pending& pending, bool ending, Pondered other_ponders,
                                                     double& probability) const noexcept {
  const int lead = pending.lead();
  const int other = 1 - lead;
  const bool leads = lead == leading_;
  const double alone = pending.peaks[static_cast<std::size_t>(lead)].confidence;
  const double doubtful = std::min(alone, settings_.doubtful);
  const bool sure = alone >= settings_.sure;
  const Duration waited = newest_ - pending.known_at;
  probability = alone;
  if (!usable(other)) return Verdict::kTell;
  if (!good(other)) {
    if (good(lead)) return Verdict::kTell;
    // In noise that both have, two leads would find twice as much that is none.
    if (!leads) return Verdict::kPassOver;
    if (!ending && sure && waited < settings_.patience) return Verdict::kWait;
    probability = doubtful;
    return Verdict::kTell;
  }
  // The other has not made up its mind and says neither yes nor no. What is strange to it may be an arc that looks like
  // a beat in one lead alone.
  const bool ponders = other_ponders != Pondered::kNothing;
  const bool heard_as_well = of(other).worth() >= settings_.close * of(lead).worth();
  if (other_ponders == Pondered::kStranger && heard_as_well) probability = doubtful;
  if (sure && ponders && waited >= settings_.courtesy) return Verdict::kTell;
  if (!ending && waited < (sure ? settings_.patience : settings_.patience_if_unsure)) return Verdict::kWait;
  if (ponders) return Verdict::kTell;
  const bool worth_little = !leads && of(lead).worth() < settings_.close * of(other).worth();
  const bool early = is_early(pending);
  if (!good(lead) || worth_little || (!leads && early)) return Verdict::kPassOver;
  const double bounded = std::min(alone, kSurest);
  const double odds = of(other).misses * bounded / (1.0 - bounded);
  probability = odds / (1.0 + odds);
  if (early && heard_as_well) probability = std::min(probability, settings_.doubtful);
  return !leads && probability < settings_.least ? Verdict::kPassOver : Verdict::kTell;
}

LeadBeat LeadAgreement::tell(const Pending& pending, double probability) noexcept {
  const int best = good(leading_) || !good(1 - leading_) ? leading_ : 1 - leading_;
  const int lead = pending.of_both() ? best : pending.lead();
  LeadBeat beat;
  beat.lead = lead;
  beat.peak = pending.peaks[static_cast<std::size_t>(lead)];
  if (lead == 1) beat.peak.time -= from_seconds(offset_s_);
  beat.peak.detected_at = newest_;
  beat.peak.confidence = probability;
  for (std::size_t i = 0; i < 2; ++i) {
    if (pending.in[i]) beat.shapes[i] = pending.peaks[i].shape;
  }

  Told told;
  told.time = beat.peak.time;
  told.in = pending.in;
  told.good = {good(0), good(1)};
  told.confidence = {pending.peaks[0].confidence, pending.peaks[1].confidence};
  told.probability = probability;
  told.early = is_early(pending);
  remember(told);
  return beat;
}

// What a lead was long in doubt about has been told by it when the beat is forgotten.
void LeadAgreement::remember(const Told& told) noexcept {
  if (told_count_ == kTold) {
    learn(told_[0]);
    std::copy(told_.begin() + 1, told_.end(), told_.begin());
    --told_count_;
  }
  told_[static_cast<std::size_t>(told_count_)] = told;
  ++told_count_;
}

// By as much as it is likely to be a beat. An early one that the other lead, heard as well, does not know is the T wave
// of the lead that tells it, and none that the other has missed.
void LeadAgreement::learn(const Told& told) noexcept {
  const double rate = told.probability / settings_.beats;
  const bool t_wave = told.early && told.in[0] != told.in[1] && told.good[0] && told.good[1];
  for (std::size_t i = 0; i < 2; ++i) {
    if (!told.good[i] || (t_wave && !told.in[i])) continue;
    Lead& lead = leads_[i];
    lead.sure += ((told.in[i] && !t_wave ? told.confidence[i] : 0.0) - lead.sure) * rate;
    lead.misses += ((told.in[i] ? 0.0 : 1.0) - lead.misses) * rate;
    lead.misses = std::clamp(lead.misses, settings_.fewest, settings_.most);
  }
  if (!told.in[0] || !told.in[1]) return;
  // Over beats that were missed or a pause the interval is no cycle.
  const double rr_s = to_seconds(told.time - both_at_);
  if (cycle_s_ > 0.0) {
    cycle_s_ += (std::min(rr_s, 2.0 * cycle_s_) - cycle_s_) / kCycleMemory;
  } else if (known_to_both_ && rr_s < kLongestCycle_s) {
    cycle_s_ = rr_s;
  }
  known_to_both_ = true;
  both_at_ = told.time;
}

}  // namespace perimap
