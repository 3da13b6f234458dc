// How many residuals in a row tell as much as one that is independent.
#pragma once

#include <vector>

namespace perimap {

// 1 + 2 (the sum of the autocorrelation of residuals in the order of their times, up to the first that chance alone
// explains): what the variance of an average of them is larger by. 1 for white residuals, and for fewer than eight.
[[nodiscard]] double correlation_length(const std::vector<double>& residuals);

}  // namespace perimap
