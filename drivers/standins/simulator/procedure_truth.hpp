// What the events of a procedure do to the organ and to clocks, as it is true and recorded.
#pragma once

#include <vector>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure.hpp"
#include "drivers/standins/truth/drift.hpp"
#include "drivers/standins/truth/organ_motion.hpp"

namespace perimap {

// X_WV: the view that the scope rests in, its origin where it meets the organ; right, down, away.
[[nodiscard]] std::vector<OrganMove> organ_moves(const Procedure& procedure, Instant start, const Pose& X_WV);

[[nodiscard]] std::vector<Drift> camera_delays(const Procedure& procedure, Instant start);
[[nodiscard]] std::vector<Drift> tracker_delays(const Procedure& procedure, Instant start);

}  // namespace perimap
