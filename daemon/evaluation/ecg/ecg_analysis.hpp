// What the ECG side of the pipeline makes of a whole trace: beats, classes, predictions.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/phase/r_peak.hpp"
#include "core/phase/rr_predictor.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

struct AnalysedBeat {
  RPeak peak;
  // The length of the cycle that begins with this beat as predicted when it became known, by each method; 0 before
  // there was a prediction. The methods learn from cycles between normal beats.
  std::array<double, 3> predicted_rr_s{};
  // The signal has broken off since the beat before, or nothing like beats was known: some may be hidden between them.
  bool after_interruption = false;
};

inline constexpr std::array<RrMethod, 3> kPredictionMethods{RrMethod::kPrevious, RrMethod::kMeanOf8,
                                                            RrMethod::kAutoregressive};

// What a lead was good for.
struct LeadUse {
  double unusable_s = 0.0;  // off or flat, or samples missing
  double without_beats_s = 0.0;
  double noisy_s = 0.0;
};

struct EcgAnalysis {
  std::vector<AnalysedBeat> beats;  // in order of time
  double duration_s = 0.0;
  double unusable_s = 0.0;          // lead off or flat, or samples missing
  std::uint64_t interruptions = 0;  // by those
  double without_beats_s = 0.0;     // nothing like beats was known in it
  double noisy_s = 0.0;             // disturbances of a beat's size
  double unpredictable_s = 0.0;     // the rhythm was atrial fibrillation or the like
  std::vector<LeadUse> leads;       // of each of two, none of one: the figures above are of what was heard better
};

// The trace begins at instant 0 of the result's clock. `progress` is told how many samples are done and answers whether
// to go on; when not, the result is of what was done.
[[nodiscard]] EcgAnalysis analyse(const EcgTrace& trace, const std::function<bool(std::size_t)>& progress);

}  // namespace perimap
