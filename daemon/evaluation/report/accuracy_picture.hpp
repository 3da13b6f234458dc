// An accuracy report as a picture.
#pragma once

#include <string>

#include "daemon/evaluation/report/accuracy.hpp"

namespace perimap {

// A self-contained SVG: bird's-eye motion paths of the features (published and true, last second), and the error over
// time (median and 95th percentile of each second) with the number of converged features.
[[nodiscard]] std::string to_svg(const AccuracyReport& report, const std::string& title);

}  // namespace perimap
