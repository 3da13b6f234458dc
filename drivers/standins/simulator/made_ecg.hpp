// An ECG that is made: waves of a healthy heart at given beats.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/standins/simulator/ecg_record.hpp"

namespace perimap {

// P, Q, R, S and T as bell curves (McSharry et al., IEEE Trans. Biomed. Eng. 50(3), 2003), on a line that wanders and
// is noisy by some hundredths of a millivolt. `beats_s`: at least two, ascending, from the record's beginning on, which
// lasts a second longer than they do.
[[nodiscard]] EcgRecord made_ecg(const std::vector<double>& beats_s, std::uint64_t seed);

}  // namespace perimap
