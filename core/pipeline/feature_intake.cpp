#include "core/pipeline/feature_intake.hpp"

#include <algorithm>

namespace perimap {
namespace {

// What earlier runs found after the map was last kept was published by ids that are not known: they are not given
// again. Several runs may have gone on from the same memory, one after the other, so that some are left out for each
// second since: more than are ever found in one.
constexpr std::uint32_t kIdsLeftOut = 10'000;
constexpr double kIdsLeftOutPerSecond = 1000.0;

}  // namespace

FeatureIntake::FeatureIntake(std::span<FeatureSlot> slots, FeatureFinder& finder) : slots_(slots), finder_(finder) {
  occupied_.reserve(slots.size());
}

void FeatureIntake::adopt(std::uint64_t frame_index, int room) noexcept {
  auto slot = slots_.begin();
  for (const FoundFeature& found : finder_.adopt(frame_index)) {
    slot = std::find_if(slot, slots_.end(), [](const FeatureSlot& s) { return s.state == SlotState::kEmpty; });
    if (slot == slots_.end() || room-- <= 0) return;
    slot->follow({.id = next_id_++,
                  .first_observed = found.first_observed,
                  .first_observed_px = found.first_observed_px,
                  .patch = found.patch,
                  .patch_state = found.patch_state,
                  .carried_px = found.patch_state.px,
                  .looks = found.looks,
                  .velocity_px = found.velocity_px,
                  .last_found_frame = frame_index - 1,
                  .last_told_frame = frame_index - 1});
    slot->last_view.begin_at(found.place_px2);
  }
}

void FeatureIntake::offer(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour,
                          int room) noexcept {
  occupied_.clear();
  int free = 0;
  for (const FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kEmpty) ++free;
    // Where it is predicted too: what hides a feature is no place for a new one.
    if (slot.state != SlotState::kEmpty && slot.match.state != MatchState::kInvalidInput) {
      occupied_.push_back(slot.match.px);
    }
  }
  finder_.offer(frame.index, frame.stamp, frame.rate, image, colour, occupied_, std::min(free, room));
}

void FeatureIntake::go_on_from(std::uint32_t largest_id, Duration ago) noexcept {
  const double since_s = std::max(0.0, to_seconds(ago));
  next_id_ = std::max(next_id_, largest_id + kIdsLeftOut + static_cast<std::uint32_t>(kIdsLeftOutPerSecond * since_s));
}

}  // namespace perimap
