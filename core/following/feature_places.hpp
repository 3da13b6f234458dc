// Who has the places of the features that are followed through video, where more are wanted than there may be.
#pragma once

#include <cstddef>
#include <span>

#include "core/following/followed_feature.hpp"

namespace perimap {

// Places that features fill; candidates are on trial beside them.
[[nodiscard]] std::ptrdiff_t filled_by_features(std::span<const FollowedFeature> features) noexcept;

// Two features at one place follow the same tissue, one of them wrongly: the older one stays.
void drop_doubles(std::span<FollowedFeature> features) noexcept;
// Of the candidates that are ripe, as many as there is room for; the others are let go.
void promote_the_surest(std::span<FollowedFeature> features, int maximum) noexcept;
// The youngest give way to those that came back.
void keep_to_maximum(std::span<FollowedFeature> features, int maximum) noexcept;

// An empty place, or that of what has been away longest; null where there is none.
[[nodiscard]] FollowedFeature* place_for_new(std::span<FollowedFeature> features) noexcept;

}  // namespace perimap
