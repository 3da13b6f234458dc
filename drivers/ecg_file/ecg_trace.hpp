// One lead of an ECG as it lies in a file.
#pragma once

#include <vector>

namespace perimap {

struct EcgTrace {
  std::vector<double> time_s;  // of each sample, ascending
  std::vector<float> mV;       // as many; not a number where the file says that there is no value
};

}  // namespace perimap
