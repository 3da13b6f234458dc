// How much a beat looks like a ventricular one: named evidence, and the log odds that it adds up to.
//
// Logistic regression, fitted on the development records (docs/evidence/ecg.md). A ventricular complex is unlike the
// patient's usual one by more than usual ones are unlike each other; it comes early, beside how the rhythm scatters,
// and beside the interval before it: in fibrillation every second beat comes early. Where its kind has come early by
// about the same time before (fixed coupling), it takes less, and a little less where its kind has recurred.
// What the ventricles conduct is narrow: a beat that is narrower than the usual one is less likely a ventricular one,
// one that is wider, of a kind that has recurred (else it may be noise), the more, and most of all right after a
// ventricular beat, where its kind has come early before, as where two kinds of them alternate; and where a pacemaker
// makes the usual beats, which then come like clockwork, it is the heart's own, unless it is early.
#pragma once

namespace perimap {

// Of a kind that has come early before: log of the intervals before it to the cycle, mean.
inline constexpr double kCameEarly = -0.08;

struct VentricularEvidence {
  double unlike = 0.0;         // the usual beat, as BeatKinds has it
  double log_rr = 0.0;         // of the interval to the rhythm's cycle
  double spread = 0.0;         // mean deviation of that, of usual beats
  double log_rr_before = 0.0;  // of the interval before; 0 where it is not known
  double narrower = 0.0;       // than the usual beat, as BeatKinds has it
  bool paced = false;          // usual beats come like clockwork
  bool recurs = false;         // as BeatKinds has it,
  bool apart = false;          // likewise,
  bool coupled = false;        // likewise
  bool after_one = false;      // the beat before was told as a ventricular one
  double kind_log_rr = 0.0;    // of the intervals before its kind to the cycle, mean,
  double kind_scatter = 0.0;   // and mean deviation of that; 0: not known
};

// How far a beat is the own one of a heart in which a pacemaker makes the usual beats, 0 to 1.
[[nodiscard]] double own_of_paced(const VentricularEvidence& evidence) noexcept;

// 0: as likely as not.
[[nodiscard]] double log_odds(const VentricularEvidence& evidence) noexcept;

}  // namespace perimap
