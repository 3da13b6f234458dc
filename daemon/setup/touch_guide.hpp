// What a user is told while landmarks are touched: which is next, and how well they fit by now.
#pragma once

#include <memory>
#include <vector>

#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/touched_points.hpp"

namespace perimap {

// Follows the poses of the tool whose tip is `tip_T`. There is enough when all landmarks are touched, the last one
// amply or with the tip lifted again, and none is off by more than the tolerance.
[[nodiscard]] std::unique_ptr<LiveGuide> touch_guide(std::vector<NamedPoint> model, const Vector3d& tip_T,
                                                     const TouchRule& rule, double tolerance_mm);

}  // namespace perimap
