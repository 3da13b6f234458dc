#include "core/following/past_layouts.hpp"

#include <algorithm>

namespace perimap {

PastLayouts::PastLayouts(std::size_t features) {
  for (Layout& layout : layouts_) layout.places.resize(features);
}

PastLayouts::Layout& PastLayouts::to_be_replaced(std::span<const FollowedFeature> features) noexcept {
  Layout* oldest = nullptr;
  Layout* oldest_unneeded = nullptr;
  for (Layout& layout : layouts_) {
    if (oldest == nullptr || layout.number < oldest->number) oldest = &layout;
    const bool is_needed = std::any_of(features.begin(), features.end(), [&layout](const FollowedFeature& feature) {
      return feature.state != FollowState::kEmpty && layout.number != 0 && feature.layout == layout.number;
    });
    if (!is_needed && (oldest_unneeded == nullptr || layout.number < oldest_unneeded->number)) {
      oldest_unneeded = &layout;
    }
  }
  return oldest_unneeded != nullptr ? *oldest_unneeded : *oldest;
}

void PastLayouts::note(std::span<const FollowedFeature> features, std::uint64_t frame) noexcept {
  Layout& layout = to_be_replaced(features);
  layout.number = ++last_number_;
  layout.frame = frame;
  for (std::size_t slot = 0; slot < layout.places.size(); ++slot) {
    layout.places[slot].id = 0;
    if (slot >= features.size()) continue;
    const FollowedFeature& feature = features[slot];
    if (feature.state == FollowState::kTracked && feature.found) layout.places[slot] = {feature.id, feature.px};
  }
}

std::uint32_t PastLayouts::newest_with(const FollowedFeature& feature, std::size_t slot,
                                       std::uint64_t frame) const noexcept {
  std::uint32_t newest = 0;
  for (const Layout& layout : layouts_) {
    if (layout.frame > frame || layout.number <= newest || slot >= layout.places.size()) continue;
    if (layout.places[slot].id == feature.id) newest = layout.number;
  }
  return newest;
}

std::optional<Vector2d> PastLayouts::place_in(std::uint32_t number, const FollowedFeature& feature,
                                              std::size_t slot) const noexcept {
  if (number == 0) return std::nullopt;
  for (const Layout& layout : layouts_) {
    if (layout.number != number || slot >= layout.places.size() || layout.places[slot].id != feature.id) continue;
    return layout.places[slot].px;
  }
  return std::nullopt;
}

std::array<std::uint32_t, PastLayouts::kMost> PastLayouts::numbers() const noexcept {
  std::array<std::uint32_t, kMost> numbers{};
  std::transform(layouts_.begin(), layouts_.end(), numbers.begin(), [](const Layout& layout) { return layout.number; });
  return numbers;
}

}  // namespace perimap
