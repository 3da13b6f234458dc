// One lead of an ECG as it lies in a file, or two that were measured together.
#pragma once

#include <vector>

namespace perimap {

struct EcgTrace {
  std::vector<double> time_s;    // of each sample, ascending
  std::vector<float> mV;         // as many; not a number where the file says that there is no value
  std::vector<float> second_mV;  // of a second lead, likewise; empty without one
};

}  // namespace perimap
