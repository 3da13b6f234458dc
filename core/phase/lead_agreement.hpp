// What two leads of one heart tell, agreed upon beat by beat.
//
// A beat that both tell is one. A beat that one lead tells alone is weighed by how often the other misses what is
// there: where it hears well and hardly misses any, the beat is doubtful or none; where it is disturbed or off, the
// lead that tells it is believed as if there were no other. What both have is no proof: an arc of electrosurgery is in
// all leads. Times come from the lead that is heard better, those of the second shifted by what it is usually later,
// since the R wave does not peak in all leads at once.
#pragma once

#include <array>
#include <chrono>
#include <optional>

#include "core/phase/ecg_signal.hpp"
#include "core/phase/pondered.hpp"
#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct LeadAgreementSettings {
  Duration one_beat = std::chrono::milliseconds(120);    // a wide complex peaks in no two leads further apart
  Duration refractory = std::chrono::milliseconds(180);  // between two beats; as the detector's
  double sure = 0.9;                                     // confidence from which on a beat of one lead is
  Duration courtesy = std::chrono::milliseconds(12);     // that such a beat waits for the other lead, if that ponders,
  Duration patience = std::chrono::milliseconds(60);     // and if it has seen nothing;
  Duration patience_if_unsure = std::chrono::milliseconds(100);  // and any other beat
  double doubtful = 0.5;  // confidence of what is strange to the other lead, or told by one of two that are disturbed
  double early = 0.6;     // of the cycle: before that a beat of the lesser lead alone is the T wave of the better's
  double misses = 0.1;    // share of the beats that a lead misses, until more is known,
  double fewest = 0.01;   // and within these bounds
  double most = 0.5;      //
  double least = 0.5;     // probability below which what the lesser lead alone tells is passed over,
  double close = 0.75;    // and worth, to the better lead's, below which all that it tells alone is
  Duration calm = std::chrono::seconds(1);  // for so long a lead must have been good, to be believed against the other
  double heard_s = 8.0;                     // memory of how well a lead is heard
  double beats = 32.0;                      // memory of what it misses and of how sure it is
  double noisy = 0.3;                       // worth of a disturbed lead, to one that is heard well
  double better = 1.15;                     // by which the other lead must be better to be the one that leads
  double largest_shift_s = 0.002;           // a beat, of what is known of the second lead's lateness
};

// A beat, and how it looks in each lead.
struct LeadBeat {
  RPeak peak;                        // its shape is that in `lead`
  int lead = 0;                      // that gives the time: 0 or 1
  std::array<QrsShape, 2> shapes{};  // of no points where the lead did not tell the beat, or not in time
};

class LeadAgreement {
 public:
  explicit LeadAgreement(const LeadAgreementSettings& settings = {}) noexcept : settings_(settings) {
    for (Lead& lead : leads_) lead.misses = settings_.misses;
  }

  // Time has passed, and what each lead is good for now.
  void hear(Instant now, const std::array<EcgSignal, 2>& signals) noexcept;
  // Lead 0 or 1 tells a beat, now.
  void hear(int lead, const RPeak& peak) noexcept;
  // The next beat that is agreed upon, in order of time, no two nearer than `refractory`; call until it gives none.
  // `ending`: nothing more will come. `ponders(lead, t, near)` is what that lead makes of what is so near to t.
  template <class Ponders>
  [[nodiscard]] std::optional<LeadBeat> decide(bool ending, Ponders&& ponders) noexcept;

  // A lead is heard, if badly; and it has been heard well for some time.
  [[nodiscard]] bool usable(int lead) const noexcept;
  [[nodiscard]] bool good(int lead) const noexcept;
  // The lead that is heard better, 0 or 1.
  [[nodiscard]] int leading() const noexcept { return leading_; }

 private:
  static constexpr int kPending = 16;
  static constexpr int kTold = 4;

  struct Pending {
    Instant time;  // as of the first lead
    Instant known_at;
    std::array<bool, 2> in{};
    std::array<RPeak, 2> peaks{};

    [[nodiscard]] bool of_both() const noexcept { return in[0] && in[1]; }
    [[nodiscard]] int lead() const noexcept { return in[0] ? 0 : 1; }  // where it is of one
  };
  struct Told {
    Instant time;
    std::array<bool, 2> in{};
    std::array<bool, 2> good{};  // the lead was heard well
    std::array<double, 2> confidence{};
    double probability = 0.0;
    bool early = false;
  };
  struct Lead {
    EcgSignal signal = EcgSignal::kLearning;
    Instant disturbed_at;  // it was last called anything but good
    double heard = 0.0;    // fading share of the time
    double sure = 1.0;     // fading mean of its confidence in beats
    double misses = 0.0;   // fading share of beats, each by its probability

    [[nodiscard]] double worth() const noexcept { return heard * sure; }
  };

  enum class Verdict { kWait, kPassOver, kTell };

  [[nodiscard]] Lead& of(int lead) noexcept { return leads_[static_cast<std::size_t>(lead)]; }
  [[nodiscard]] const Lead& of(int lead) const noexcept { return leads_[static_cast<std::size_t>(lead)]; }
  // An instant of the first lead, in that lead.
  [[nodiscard]] Instant in_lead(int lead, Instant t) const noexcept {
    return lead == 0 ? t : t + from_seconds(offset_s_);
  }
  [[nodiscard]] bool join_told(int lead, const RPeak& peak, Instant time) noexcept;
  void learn_offset(Instant first, Instant second) noexcept;
  [[nodiscard]] Verdict verdict(const Pending& pending, bool ending, Pondered other,
                                double& probability) const noexcept;
  [[nodiscard]] Verdict verdict_of_one(const Pending& pending, bool ending, Pondered other,
                                       double& probability) const noexcept;
  [[nodiscard]] bool is_early(const Pending& pending) const noexcept;
  [[nodiscard]] double probability_of_both(const Pending& pending) const noexcept;
  [[nodiscard]] LeadBeat tell(const Pending& pending, double probability) noexcept;
  void drop_first() noexcept;
  void remember(const Told& told) noexcept;
  void learn(const Told& told) noexcept;

  LeadAgreementSettings settings_;
  std::array<Lead, 2> leads_;
  int leading_ = 0;
  Instant newest_;
  bool started_ = false;
  double offset_s_ = 0.0;                    // of the second lead's R peak after the first's
  int offsets_ = 0;                          // beats it was learnt from, at most as many as are remembered
  bool known_to_both_ = false;               // a beat was,
  Instant both_at_;                          // the last of them
  double cycle_s_ = 0.0;                     // fading mean of the intervals between them
  std::array<Pending, kPending> pending_{};  // in order of time
  int pending_count_ = 0;
  std::array<Told, kTold> told_{};  // the last beats, oldest first
  int told_count_ = 0;
};

template <class Ponders>
std::optional<LeadBeat> LeadAgreement::decide(bool ending, Ponders&& ponders) noexcept {
  while (pending_count_ > 0) {
    const Pending first = pending_[0];
    const int other = 1 - first.lead();
    const Pondered pondered =
        first.of_both() ? Pondered::kNothing : ponders(other, in_lead(other, first.time), settings_.one_beat);
    double probability = 0.0;
    const Verdict said = verdict(first, ending, pondered, probability);
    if (said == Verdict::kWait) return std::nullopt;
    drop_first();
    if (said == Verdict::kTell) return tell(first, probability);
  }
  return std::nullopt;
}

}  // namespace perimap
