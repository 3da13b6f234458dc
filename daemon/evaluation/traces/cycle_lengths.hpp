// Phases of the heart by R peaks that are known so far, and how long the cycle that runs may be.
#pragma once

#include <cstddef>
#include <vector>

namespace perimap {

// The ECG's part of an experiment on a trace: what a detector would have told by now.
class CycleLengths {
 public:
  // `peaks_s`: at least two, growing. `now_s`: every peak until then is in them. `systole_s`: what goes by in the same
  // way in every cycle, from its beginning; zero where each is stretched as a whole.
  CycleLengths(std::vector<double> peaks_s, double now_s, double systole_s);

  struct Candidate {
    double length_s = 0.0;
    double weight = 0.0;  // they sum to one
  };
  // Lengths that the last cycle may have, since no peak has ended it: as the cycles before it were, smoothed.
  [[nodiscard]] const std::vector<Candidate>& candidates() const noexcept { return candidates_; }
  // rad, a multiple of 2 pi at each peak, if the last cycle is so long; another of the usual length follows.
  [[nodiscard]] double phase(double t_s, double last_length_s) const;

 private:
  [[nodiscard]] double within(double since_s, double length_s) const;

  std::vector<double> peaks_s_;
  double systole_s_ = 0.0;
  double usual_s_ = 0.0;  // median
  std::vector<Candidate> candidates_;
};

}  // namespace perimap
