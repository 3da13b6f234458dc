// Which of the places where a pointer was held still are the landmarks.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// Of each landmark, in their order, the place that is it: those of all places in their order that lie to each other as
// the landmarks do (least squares of a rigid fit). A pointer is held still elsewhere too, before the first one and
// after the last. None with fewer places than landmarks; with more, none where there are fewer than four landmarks,
// which fit anyhow, or more than four places too many.
[[nodiscard]] std::optional<std::vector<std::size_t>> touched_landmarks(const std::vector<Vector3d>& landmarks_I,
                                                                        const std::vector<Vector3d>& places_W);

}  // namespace perimap
