// How much a beat looks like a ventricular one: named evidence, and the log odds that it adds up to.
//
// Logistic regression, fitted on the development records (docs/evidence/ecg.md). A ventricular complex takes longer and
// so covers more area than the patient's usual one, which noise or an aberrant way rather makes smaller; its kind has
// done so before; its shape is another; and it comes early. In fibrillation every second beat comes early: what counts
// is how early it comes beside the interval before as well.
#pragma once

#include "core/phase/qrs_shape.hpp"

namespace perimap {

struct VentricularEvidence {
  double log_area = 0.0;       // of the complex, to the usual one's
  double log_kind_area = 0.0;  // likewise, mean of those of its kind before; 0 where none were
  double strangeness = 0.0;    // 1 - correlation with the usual shape
  double log_rr = 0.0;         // of the interval to the rhythm's cycle
  double log_rr_before = 0.0;  // of the interval before that; 0 where it is not known
};

// 0: as likely as not, but for a margin in favour of a usual beat.
[[nodiscard]] double log_odds(const VentricularEvidence& evidence) noexcept;

// What the complex, as the sum of its slope from its begin on, covers on either side of the line.
[[nodiscard]] double area(const QrsShape& shape) noexcept;

}  // namespace perimap
