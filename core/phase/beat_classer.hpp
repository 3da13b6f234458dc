// What kind of beat an R peak is: by its interval, and by its shape against the patient's usual one.
//
// Causal: the class is said with the beat and not revised. A premature beat is ventricular (ventricular_evidence), or
// comes much too early in the usual shape (atrial), unless the rhythm is one in which beats come at any time. A
// ventricular beat may come on time as well, when its kind recurs; where beats go on in that shape, on time, the
// patient's conduction has changed, and they are normal to the rhythm, sooner where the kind was not one that comes
// early. The beat after a premature one is measured from the last normal beat as well, so that neither an interpolated
// beat nor a compensatory pause makes it irregular.
#pragma once

#include "core/phase/beat_kinds.hpp"
#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/recent_values.hpp"
#include "core/phase/rhythm_monitor.hpp"
#include "core/phase/rhythm_scatter.hpp"
#include "core/phase/ventricular_evidence.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class BeatClasser {
 public:
  // The next R peak in order of time, the same with its class.
  [[nodiscard]] RPeak classify(RPeak peak) noexcept;

  // The signal was interrupted: the next interval means nothing.
  void interrupt() noexcept {
    has_last_ = false;
    has_normal_ = false;
    raw_rr_s_ = 0.0;
    last_kind_ = -1;
    last_ventricular_ = false;
  }

 private:
  static constexpr int kRhythm = 8;

  [[nodiscard]] double strangeness(const QrsShape& shape) const noexcept;
  [[nodiscard]] VentricularEvidence evidence_of(const RPeak& peak,
                                                const BeatKinds::Comparison& compared) const noexcept;
  [[nodiscard]] bool ventricular(const RPeak& peak, const VentricularEvidence& evidence) const noexcept;
  [[nodiscard]] BeatClass by_interval(const RPeak& peak, bool unusual, bool at_any_time) const noexcept;
  [[nodiscard]] bool is_due(const RPeak& peak, int most_cycles) const noexcept;
  [[nodiscard]] double log_of_cycle(double rr_s) const noexcept;
  void learn_kind(const RPeak& peak, const BeatKinds::Comparison& compared) noexcept;
  void learn_rhythm(const RPeak& peak, bool unusual) noexcept;
  void push_cycle(double rr_s) noexcept;

  ShapeTemplates templates_;
  BeatKinds kinds_;
  RhythmMonitor rhythm_;               // of beats of usual shape
  RecentValues<kRhythm> normal_rr_s_;  // between beats in rhythm
  bool has_last_ = false;
  bool has_normal_ = false;
  RhythmScatter scatter_;  // of intervals between beats of the usual kind
  bool last_usual_kind_ = false;
  bool last_unusual_ = false;
  bool last_ventricular_ = false;
  int on_time_in_one_shape_ = 0;  // in a row, after the first,
  bool ectopic_run_ = false;      // of a kind that had come early before
  int last_kind_ = -1;
  BeatClass last_class_ = BeatClass::kNormal;
  Instant last_;
  double raw_rr_s_ = 0.0;   // the last interval, between whatever beats
  double last_rr_s_ = 0.0;  // when both its beats were normal, else 0
  Instant last_normal_;
  int untaught_ = 0;  // beats in a row that taught the cycle nothing
};

}  // namespace perimap
