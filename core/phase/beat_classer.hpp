// What kind of beat an R peak is: by its interval, and by its shape against the patient's usual one.
//
// Causal: the class is said with the beat and not revised. A premature beat is told by coming early in a shape of its
// own (ventricular), or much too early in the usual one (atrial). A ventricular beat may come on time as well: a wide
// one, in a shape unlike the usual one that recurs, is classed like a premature one. Where beats go on in that shape,
// on time, the patient's conduction has changed, and they are normal to the rhythm. The beat after a premature one is
// measured from the last normal beat as well, so that neither an interpolated beat nor a compensatory pause makes it
// irregular.
#pragma once

#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/recent_values.hpp"
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
  [[nodiscard]] BeatClass by_interval(const RPeak& peak, bool unusual) const noexcept;
  [[nodiscard]] bool recurs_beside_the_usual(const QrsShape& shape) const noexcept;
  [[nodiscard]] bool is_due(const RPeak& peak, int most_cycles) const noexcept;
  void learn(const RPeak& peak, bool unusual) noexcept;

  ShapeTemplates templates_;
  RecentValues<kRhythm> normal_rr_s_;  // between beats in rhythm
  bool has_last_ = false;
  bool has_normal_ = false;
  bool last_unusual_ = false;
  int on_time_in_another_shape_ = 0;  // in a row
  double unusual_share_ = 0.0;        // of the beats, older ones fading
  double usual_sharpness_ = 0.0;      // of the QRS complexes of usual shape, fading mean
  BeatClass last_class_ = BeatClass::kNormal;
  Instant last_;
  double strangeness_ = 0.05;  // of normal beats, fading mean
  double raw_rr_s_ = 0.0;      // the last interval, between whatever beats
  double last_rr_s_ = 0.0;     // when both its beats were normal, else 0
  Instant last_normal_;
};

}  // namespace perimap
