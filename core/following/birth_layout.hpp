// Where a feature ought to be among those that began when it did.
#pragma once

#include <optional>
#include <span>

#include "core/following/common_motion.hpp"
#include "core/following/followed_feature.hpp"

namespace perimap {

// How far it is from where the others have it, px: those that began in the same frame, are found and have not been
// away. None where they are too few, half of them do not go to alike_px as one picture does, or those around it do not:
// what lies at another depth goes another way. `scratch` is written over. Takes nothing from the heap.
[[nodiscard]] std::optional<double> off_among_its_own(std::span<const FollowedFeature> features,
                                                      const FollowedFeature& feature, double alike_px,
                                                      CommonMotion& scratch) noexcept;

}  // namespace perimap
