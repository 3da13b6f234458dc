// How sure a beat is told: its probability, and what keeps it from being believed.
//
// The probability knows of no arcs: an electrosurgical burst makes complexes of all shapes, and one of a hundred looks
// like this patient's beats. It is suspicious by how unlike its kind it is, times how early it comes (in the rhythm's
// own deviations), times the disturbances of late: an arc is seldom both where a beat is due and exactly like one.
#pragma once

#include "core/phase/r_peak_detector_settings.hpp"

namespace perimap {

struct BeatCircumstances {
  double probability = 0.0;
  double correlation = 1.0;      // with its kind
  double gain = 1.0;             // to its kind's size
  double of_cycle = 1.0;         // the interval before it, to the usual cycle
  double usual_of_cycle = 1.0;   // the same, of its kind, where that comes early
  double spread = 0.06;          // of the logarithm of that
  double disturbed = 0.0;        // disturbances of late, fading
  bool familiar = false;         // like a settled kind that looks like a QRS complex,
  bool long_known = false;       // which has been known for longer than a burst lasts
  bool any_known = false;        // some kind recurs
  bool heard_for_long = false;   // beats have been looked for for longer than a burst lasts
  bool unlike_any_beat = false;  // the line stays at another level, or is rough
  bool may_be_followed = false;  // sharper complexes often follow its kind: a P wave that is not conducted
  bool rivalled = false;         // another in its cycle looks as much like a QRS complex
  bool in_steady_noise = false;  // noise that is always there comes near to the beats
  bool lost_in_noise = false;    // unlike the beats, among disturbances
};

[[nodiscard]] double suspicion(const BeatCircumstances& beat, const DecisionSettings& settings) noexcept;
[[nodiscard]] double confidence(const BeatCircumstances& beat, const DecisionSettings& settings) noexcept;

}  // namespace perimap
