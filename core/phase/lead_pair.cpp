#include "core/phase/lead_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr Duration kLongestStep = std::chrono::milliseconds(30);
constexpr double kSurest = 0.995;  // no lead is as sure as to rule the other out

Duration distance(Instant a, Instant b) noexcept { return a > b ? a - b : b - a; }

int rank(EcgSignal signal) noexcept {
  switch (signal) {
    case EcgSignal::kGood:
      return 4;
    case EcgSignal::kNoisy:
      return 3;
    case EcgSignal::kLearning:
      return 2;
    case EcgSignal::kFlat:
      return 1;
    case EcgSignal::kLeadOff:
      break;
  }
  return 0;
}

}  // namespace

// In a burst that both leads have, each is called good now and then.
bool LeadPair::good(int lead) const noexcept {
  const Lead& l = leads_[static_cast<std::size_t>(lead)];
  return l.detector.signal() == EcgSignal::kGood && newest_ - l.disturbed_at >= settings_.calm;
}

bool LeadPair::usable(int lead) const noexcept {
  return rank(leads_[static_cast<std::size_t>(lead)].detector.signal()) >= rank(EcgSignal::kNoisy);
}

EcgSignal LeadPair::signal() const noexcept {
  const EcgSignal first = leads_[0].detector.signal();
  if (!two_) return first;
  const EcgSignal second = leads_[1].detector.signal();
  return rank(second) > rank(first) ? second : first;
}

std::optional<LeadBeat> LeadPair::push(Instant t, float mV) noexcept {
  if (two_) return push(t, mV, kNone);
  const std::optional<RPeak> peak = leads_[0].detector.push(t, mV);
  interruptions_ = leads_[0].detector.interruptions();
  if (!peak) return std::nullopt;
  return LeadBeat{*peak, 0, {peak->shape, QrsShape{}}};
}

std::optional<LeadBeat> LeadPair::push(Instant t, float first_mV, float second_mV) noexcept {
  if (!two_ && std::isfinite(second_mV)) {
    two_ = true;
    for (Lead& lead : leads_) lead.misses = settings_.misses;
    interrupted_ = {leads_[0].detector.interruptions(), leads_[1].detector.interruptions()};
  }
  if (!two_) return push(t, first_mV);
  const std::array<float, 2> values{first_mV, second_mV};
  for (int lead = 0; lead < 2; ++lead) {
    const auto at = static_cast<std::size_t>(lead);
    if (const auto peak = leads_[at].detector.push(t, values[at])) take(lead, *peak, t);
  }
  hear(t);
  return decide(t, false);
}

void LeadPair::lead_off(Instant t) noexcept {
  leads_[0].detector.lead_off(t);
  if (!two_) {
    interruptions_ = leads_[0].detector.interruptions();
    return;
  }
  leads_[1].detector.lead_off(t);
  hear(t);
}

std::optional<LeadBeat> LeadPair::flush() noexcept {
  if (!two_) {
    const std::optional<RPeak> peak = leads_[0].detector.flush();
    if (!peak) return std::nullopt;
    return LeadBeat{*peak, 0, {peak->shape, QrsShape{}}};
  }
  for (int lead = 0; lead < 2; ++lead) {
    RPeakDetector& detector = leads_[static_cast<std::size_t>(lead)].detector;
    while (const auto peak = detector.flush()) take(lead, *peak, newest_);
  }
  return decide(newest_, true);
}

// How well each lead is heard, which of them leads, and whether none is heard any more.
void LeadPair::hear(Instant t) noexcept {
  const double step_s = started_ && t > newest_ ? to_seconds(std::min(t - newest_, kLongestStep)) : 0.0;
  started_ = true;
  newest_ = std::max(t, newest_);
  bool broken = false;
  for (int lead = 0; lead < 2; ++lead) {
    const auto at = static_cast<std::size_t>(lead);
    if (leads_[at].detector.signal() != EcgSignal::kGood) leads_[at].disturbed_at = newest_;
    const double now = good(lead) ? 1.0 : usable(lead) ? settings_.noisy : 0.0;
    leads_[at].heard += (now - leads_[at].heard) * step_s / settings_.heard_s;
    broken = broken || leads_[at].detector.interruptions() != interrupted_[at];
    interrupted_[at] = leads_[at].detector.interruptions();
  }
  if (broken && !usable(0) && !usable(1)) ++interruptions_;
  const int other = 1 - leading_;
  const bool better = worth(leads_[static_cast<std::size_t>(other)]) >
                      settings_.better * worth(leads_[static_cast<std::size_t>(leading_)]);
  if (usable(other) && (better || !usable(leading_))) leading_ = other;
}

void LeadPair::take(int lead, const RPeak& peak, Instant now) noexcept {
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
  pending.known_at = now;
  pending.in[at] = true;
  pending.peaks[at] = peak;
  ++pending_count_;
}

// A beat that has been told already, which this lead was long in doubt about.
bool LeadPair::join_told(int lead, const RPeak& peak, Instant time) noexcept {
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
void LeadPair::learn_offset(Instant first, Instant second) noexcept {
  const double off_s = to_seconds(second - first) - offset_s_;
  offsets_ = std::min(offsets_ + 1, static_cast<int>(settings_.beats));
  const double step_s = off_s / offsets_;
  const bool settled = offsets_ > 8;
  offset_s_ += settled ? std::clamp(step_s, -settings_.largest_shift_s, settings_.largest_shift_s) : step_s;
}

std::optional<LeadBeat> LeadPair::decide(Instant now, bool ending) noexcept {
  while (pending_count_ > 0) {
    const Pending first = pending_[0];
    double probability = 0.0;
    const Verdict said = verdict(first, now, ending, probability);
    if (said == Verdict::kWait) return std::nullopt;
    std::copy(pending_.begin() + 1, pending_.begin() + pending_count_, pending_.begin());
    --pending_count_;
    if (said == Verdict::kTell) return tell(first, probability, now);
  }
  return std::nullopt;
}

bool LeadPair::is_early(const Pending& pending) const noexcept {
  if (told_count_ == 0 || cycle_s_ <= 0.0) return false;
  const Instant last = told_[static_cast<std::size_t>(told_count_ - 1)].time;
  return to_seconds(pending.time - last) < settings_.early * cycle_s_;
}

LeadPair::Verdict LeadPair::verdict(const Pending& pending, Instant now, bool ending,
                                    double& probability) const noexcept {
  if (told_count_ > 0 && pending.time - told_[static_cast<std::size_t>(told_count_ - 1)].time < settings_.refractory) {
    return Verdict::kPassOver;
  }
  if (pending.in[0] && pending.in[1]) {
    const bool alike = good(0) == good(1);
    const auto heard = static_cast<std::size_t>(alike ? leading_ : good(0) ? 0 : 1);
    probability = good(0) && good(1) ? std::max(pending.peaks[0].confidence, pending.peaks[1].confidence)
                                     : pending.peaks[heard].confidence;
    return Verdict::kTell;
  }
  const int lead = pending.in[0] ? 0 : 1;
  const int other = 1 - lead;
  const double alone = pending.peaks[static_cast<std::size_t>(lead)].confidence;
  probability = alone;
  if (!usable(other)) return Verdict::kTell;
  // In noise that both have, two leads would find twice as much that is none.
  if (!good(other)) return lead == leading_ || good(lead) ? Verdict::kTell : Verdict::kPassOver;
  const bool sure = alone >= settings_.sure;
  const Duration waited = now - pending.known_at;
  const Instant there = other == 0 ? pending.time : pending.time + from_seconds(offset_s_);
  // It has not made up its mind and says neither yes nor no.
  const bool ponders = leads_[static_cast<std::size_t>(other)].detector.ponders(there, settings_.one_beat);
  if (sure && ponders && waited >= settings_.courtesy) return Verdict::kTell;
  if (!ending && waited < (sure ? settings_.patience : settings_.patience_if_unsure)) return Verdict::kWait;
  if (ponders) return Verdict::kTell;
  const bool leads = lead == leading_;
  if (!good(lead) ||
      (!leads && (is_early(pending) || worth(leads_[static_cast<std::size_t>(lead)]) <
                                           settings_.close * worth(leads_[static_cast<std::size_t>(other)])))) {
    return Verdict::kPassOver;
  }
  const double bounded = std::min(alone, kSurest);
  const double odds = leads_[static_cast<std::size_t>(other)].misses * bounded / (1.0 - bounded);
  probability = odds / (1.0 + odds);
  return !leads && probability < settings_.least ? Verdict::kPassOver : Verdict::kTell;
}

LeadBeat LeadPair::tell(const Pending& pending, double probability, Instant now) noexcept {
  const int best = good(leading_) || !good(1 - leading_) ? leading_ : 1 - leading_;
  const int lead = pending.in[0] && pending.in[1] ? best : pending.in[0] ? 0 : 1;
  const auto at = static_cast<std::size_t>(lead);
  LeadBeat beat;
  beat.lead = lead;
  beat.peak = pending.peaks[at];
  if (lead == 1) beat.peak.time -= from_seconds(offset_s_);
  beat.peak.detected_at = now;
  beat.peak.confidence = probability;
  for (std::size_t i = 0; i < 2; ++i) {
    if (pending.in[i]) beat.shapes[i] = pending.peaks[i].shape;
  }

  Told told;
  told.time = beat.peak.time;
  told.in = pending.in;
  told.good = {good(0), good(1)};
  told.confidence = {pending.peaks[0].confidence, pending.peaks[1].confidence};
  told.sure = probability >= 0.5;
  told.early = is_early(pending);
  if (told_count_ > 0 && told.sure) {
    const double rr_s = to_seconds(told.time - told_[static_cast<std::size_t>(told_count_ - 1)].time);
    if (rr_s < 3.0) cycle_s_ += cycle_s_ > 0.0 ? (rr_s - cycle_s_) / 8.0 : rr_s;
  }
  remember(told);
  return beat;
}

// What a lead was long in doubt about has been told by it when the beat is forgotten.
void LeadPair::remember(const Told& told) noexcept {
  if (told_count_ == kTold) {
    learn(told_[0]);
    std::copy(told_.begin() + 1, told_.end(), told_.begin());
    --told_count_;
  }
  told_[static_cast<std::size_t>(told_count_)] = told;
  ++told_count_;
}

void LeadPair::learn(const Told& told) noexcept {
  for (std::size_t i = 0; i < 2; ++i) {
    if (!told.good[i] || !told.sure) continue;
    Lead& lead = leads_[i];
    // An early beat that the other, heard as well, does not know is this lead's T wave, or the other's miss: neither
    // speaks for this lead.
    const bool strange = told.in[i] && told.early && told.good[1 - i] && !told.in[1 - i];
    const double confidence = told.in[i] && !strange ? told.confidence[i] : 0.0;
    lead.sure += (confidence - lead.sure) / settings_.beats;
    if (!(told.early && !told.in[i])) lead.misses += ((told.in[i] ? 0.0 : 1.0) - lead.misses) / settings_.beats;
    lead.misses = std::clamp(lead.misses, settings_.fewest, settings_.most);
  }
}

}  // namespace perimap
