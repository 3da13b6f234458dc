// How far a sum of numbers that follow each other in time is from what it would be of other noise.
#pragma once

#include <vector>

namespace perimap {

// The variance of their sum, where each may go together with those up to a tenth of them, or a hundred, behind it
// (Newey and West, Econometrica 55(3), 1987). The numbers are about zero, in the order of their times.
[[nodiscard]] double variance_of_sum(const std::vector<double>& values);

}  // namespace perimap
