// How much a beat looks like a ventricular one: named evidence, and the log odds that it adds up to.
//
// Logistic regression, fitted on the development records (docs/evidence/ecg.md). A ventricular complex is unlike the
// patient's usual one by more than usual ones are unlike each other; it comes early, beside how the rhythm scatters,
// and beside the interval before it: in fibrillation every second beat comes early. Where its kind has come early by
// about the same time before (fixed coupling), it takes less, and a little less where its kind has recurred.
#pragma once

namespace perimap {

struct VentricularEvidence {
  double unlike = 0.0;         // the usual beat, as BeatKinds has it
  double log_rr = 0.0;         // of the interval to the rhythm's cycle
  double spread = 0.0;         // mean deviation of that, of usual beats
  double log_rr_before = 0.0;  // of the interval before; 0 where it is not known
  bool apart = false;          // as BeatKinds has it,
  bool coupled = false;        // likewise
};

// 0: as likely as not.
[[nodiscard]] double log_odds(const VentricularEvidence& evidence) noexcept;

}  // namespace perimap
