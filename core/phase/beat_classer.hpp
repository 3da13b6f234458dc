// What kind of beat an R peak is: by its interval, and by its shape against the patient's usual one.
//
// Causal: the class is said with the beat and not revised. A premature beat is ventricular (ventricular_evidence), or
// comes much too early in the usual shape (atrial), unless the rhythm is one in which beats come at any time. A
// ventricular beat may come on time as well, when its kind recurs; where beats go on in that shape, on time, the
// patient's conduction has changed, and they are normal to the rhythm. The beat after a premature one is measured from
// the last normal beat as well, so that neither an interpolated beat nor a compensatory pause makes it irregular.
#pragma once

#include <array>

#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/recent_values.hpp"
#include "core/phase/rhythm_monitor.hpp"
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
  }

 private:
  static constexpr int kRhythm = 8;

  [[nodiscard]] double strangeness(const QrsShape& shape) const noexcept;
  [[nodiscard]] bool ventricular(const RPeak& peak, double strange) const noexcept;
  [[nodiscard]] BeatClass by_interval(const RPeak& peak, bool unusual) const noexcept;
  [[nodiscard]] bool is_due(const RPeak& peak, int most_cycles) const noexcept;
  void learn_shape(const QrsShape& shape, bool unusual) noexcept;
  void learn_rhythm(const RPeak& peak, bool unusual) noexcept;

  // Of a kind of beats, to the usual ones.
  struct KindArea {
    double log_area = 0.0;  // fading mean
    double members = 0.0;   // bounded
  };

  ShapeTemplates templates_;
  std::array<KindArea, ShapeTemplates::kTemplates> areas_{};
  double usual_area_ = 0.0;            // of the beats of usual shape, fading mean
  RhythmMonitor rhythm_;               // of these
  RecentValues<kRhythm> normal_rr_s_;  // between beats in rhythm
  bool has_last_ = false;
  bool has_normal_ = false;
  bool last_unusual_ = false;
  int on_time_in_another_shape_ = 0;  // in a row
  BeatClass last_class_ = BeatClass::kNormal;
  Instant last_;
  double raw_rr_s_ = 0.0;   // the last interval, between whatever beats
  double last_rr_s_ = 0.0;  // when both its beats were normal, else 0
  Instant last_normal_;
};

}  // namespace perimap
