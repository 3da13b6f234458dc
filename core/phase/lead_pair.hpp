// The beats of one heart, of which one or two leads are heard.
//
// Each lead has a detector of its own, and what they tell is agreed upon beat by beat. A beat that both tell is one. A
// beat that one lead tells alone is weighed by how often the other misses what is there: where it hears well and
// hardly misses any, the beat is doubtful or none; where it is disturbed or off, the lead that tells it is believed as
// if there were no other. Times come from the lead that is heard better, those of the second shifted by what it is
// usually later, since the R wave does not peak in all leads at once.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "core/phase/ecg_signal.hpp"
#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/r_peak_detector.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct LeadPairSettings {
  Duration one_beat = std::chrono::milliseconds(120);    // a wide complex peaks in no two leads further apart
  Duration refractory = std::chrono::milliseconds(180);  // between two beats; as the detector's
  double sure = 0.9;                                     // confidence from which on a beat of one lead is
  Duration courtesy = std::chrono::milliseconds(12);     // that such a beat waits for the other lead, if that ponders,
  Duration patience = std::chrono::milliseconds(60);     // and if it has seen nothing;
  Duration patience_if_unsure = std::chrono::milliseconds(100);  // and any other beat
  double early = 0.6;    // of the cycle: before that a beat of the lesser lead alone is the T wave of the better's
  double misses = 0.1;   // share of the beats that a lead misses, until more is known,
  double fewest = 0.01;  // and within these bounds
  double most = 0.5;     //
  double least = 0.5;    // probability below which what the lesser lead alone tells is passed over,
  double close = 0.75;   // and worth, to the better lead's, below which all that it tells alone is
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

class LeadPair {
 public:
  explicit LeadPair(const LeadPairSettings& settings = {}) noexcept : settings_(settings) {}

  // The next sample of a heart of which one lead is heard. As RPeakDetector's, and as soon.
  [[nodiscard]] std::optional<LeadBeat> push(Instant t, float mV) noexcept;
  // Of both; a value that is not finite is missing. Beats come in order of time, no two nearer than `refractory`.
  [[nodiscard]] std::optional<LeadBeat> push(Instant t, float first_mV, float second_mV) noexcept;
  // All electrodes fell off.
  void lead_off(Instant t) noexcept;
  // As RPeakDetector's.
  [[nodiscard]] std::optional<LeadBeat> flush() noexcept;

  // Of the lead that is heard better.
  [[nodiscard]] EcgSignal signal() const noexcept;
  // How often nothing was heard any more in any lead.
  [[nodiscard]] std::uint64_t interruptions() const noexcept { return interruptions_; }
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
  };
  struct Told {
    Instant time;
    std::array<bool, 2> in{};
    std::array<bool, 2> good{};  // the lead was heard well
    std::array<double, 2> confidence{};
    bool sure = false;
    bool early = false;
  };
  struct Lead {
    RPeakDetector detector;
    Instant disturbed_at;  // it was last called anything but good
    double heard = 0.0;    // fading share of the time
    double sure = 1.0;     // fading mean of its confidence in beats
    double misses = 0.0;   // fading share of sure beats
  };

  enum class Verdict { kWait, kPassOver, kTell };

  [[nodiscard]] bool usable(int lead) const noexcept;
  [[nodiscard]] bool good(int lead) const noexcept;
  [[nodiscard]] double worth(const Lead& lead) const noexcept { return lead.heard * lead.sure; }
  void hear(Instant t) noexcept;
  void take(int lead, const RPeak& peak, Instant now) noexcept;
  [[nodiscard]] bool join_told(int lead, const RPeak& peak, Instant time) noexcept;
  void learn_offset(Instant first, Instant second) noexcept;
  [[nodiscard]] std::optional<LeadBeat> decide(Instant now, bool ending) noexcept;
  [[nodiscard]] Verdict verdict(const Pending& pending, Instant now, bool ending, double& probability) const noexcept;
  [[nodiscard]] bool is_early(const Pending& pending) const noexcept;
  [[nodiscard]] LeadBeat tell(const Pending& pending, double probability, Instant now) noexcept;
  void remember(const Told& told) noexcept;
  void learn(const Told& told) noexcept;

  LeadPairSettings settings_;
  std::array<Lead, 2> leads_;
  bool two_ = false;  // a second lead has been heard
  int leading_ = 0;
  Instant newest_;
  bool started_ = false;
  double offset_s_ = 0.0;  // of the second lead's R peak after the first's
  int offsets_ = 0;        // beats it was learnt from, at most as many as are remembered
  double cycle_s_ = 0.0;   // fading mean of the intervals told
  std::array<std::uint64_t, 2> interrupted_{};
  std::uint64_t interruptions_ = 0;
  std::array<Pending, kPending> pending_{};  // in order of time
  int pending_count_ = 0;
  std::array<Told, kTold> told_{};  // the last beats, oldest first
  int told_count_ = 0;
};

}  // namespace perimap
