#include "core/pipeline/load_shedding.hpp"

#include <algorithm>
#include <bit>

namespace perimap {
namespace {

// The higher, the more useful.
int usefulness(const FeatureSlot& slot) noexcept {
  if (slot.state != SlotState::kMapped) return 0;
  return slot.converged ? 2 : 1;
}

bool more_useful(const FeatureSlot* a, const FeatureSlot* b) noexcept {
  if (usefulness(*a) != usefulness(*b)) return usefulness(*a) > usefulness(*b);
  // Without a map there is no deviation yet.
  if (a->state == SlotState::kMapped && a->largest_deviation_mm != b->largest_deviation_mm) {
    return a->largest_deviation_mm < b->largest_deviation_mm;
  }
  return a->id < b->id;
}

}  // namespace

bool LoadSheddingDecision::add(const FrameTime& frame, int followed) noexcept {
  const bool overrun = frame.learning_put_off || frame.until_evaluated > budget_;
  const bool calm = !overrun && to_seconds(frame.until_evaluated) < kCalmShare * to_seconds(budget_);
  constexpr std::uint32_t kMask = (1U << kWindow) - 1U;
  overruns_ = (overruns_ << 1U | (overrun ? 1U : 0U)) & kMask;
  since_taken_back_ = std::min(since_taken_back_ + 1, kTooSoonFrames);
  if (overrun) {
    calm_ = 0;
  } else if (calm) {
    ++calm_;
  }
  if (std::popcount(overruns_) >= kOverruns && followed > kLeast) {
    patience_ = since_taken_back_ < kTooSoonFrames ? std::min(2 * patience_, kLongestPatience) : patience_;
    const int in_use = std::min(followed, limit_);
    limit_ = std::max(kLeast, in_use - std::max(1, in_use / 8));
    // What was shed takes effect from here on.
    overruns_ = 0;
    calm_ = 0;
    return true;
  }
  if (limit_ < maximum_ && calm_ >= kCalmFrames * patience_) take_back();
  return false;
}

void LoadSheddingDecision::take_back() noexcept {
  limit_ = std::min(maximum_, limit_ + std::max(1, maximum_ / 16));
  calm_ = 0;
  since_taken_back_ = 0;
  if (limit_ == maximum_) patience_ = 1;
}

LoadShedding::LoadShedding(std::span<FeatureSlot> slots) : slots_(slots) { order_.reserve(slots.size()); }

int LoadShedding::followed() const noexcept {
  return static_cast<int>(std::count_if(slots_.begin(), slots_.end(), [](const FeatureSlot& slot) {
    return slot.state != SlotState::kEmpty && !slot.shed;
  }));
}

std::size_t LoadShedding::apply(int limit) noexcept {
  order_.clear();
  std::size_t shed = 0;
  for (FeatureSlot& slot : slots_) {
    if (slot.state == SlotState::kEmpty) {
      slot.shed = false;
      continue;
    }
    order_.push_back(&slot);
    shed += slot.shed ? 1 : 0;
  }
  const std::size_t keep = std::min(order_.size(), static_cast<std::size_t>(std::max(0, limit)));
  // As before, unless the number changes: two alike must not take turns.
  if (order_.size() - shed == keep) return shed;
  std::nth_element(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(keep), order_.end(), more_useful);
  for (std::size_t i = 0; i < order_.size(); ++i) order_[i]->shed = i >= keep;
  return order_.size() - keep;
}

}  // namespace perimap
