#include "core/pipeline/load_shedding.hpp"

#include <algorithm>
#include <bit>

namespace perimap {
namespace {

// Whether a feature can be seen, the higher the likelier.
constexpr int kUnseen = 0;
constexpr int kPerhapsSeen = 1;
constexpr int kSeen = 2;

// The higher, the more useful.
int usefulness(const FeatureSlot& slot) noexcept {
  if (slot.state != SlotState::kMapped) return 0;
  return slot.converged ? 2 : 1;
}

}  // namespace

bool LoadSheddingDecision::add(const FrameTime& frame, int followed) noexcept {
  const bool overrun = frame.learning_put_off || frame.until_evaluated > budget_;
  const bool calm = !overrun && to_seconds(frame.until_evaluated) < kCalmShare * to_seconds(budget_);
  constexpr std::uint32_t kMask = (1U << kWindow) - 1U;
  overruns_ = (overruns_ << 1U | (overrun ? 1U : 0U)) & kMask;
  if (since_taken_back_ != kNever) ++since_taken_back_;
  if (overrun) {
    calm_ = 0;
  } else if (calm) {
    ++calm_;
  }
  if (std::popcount(overruns_) >= kOverruns && followed > kLeast) {
    patience_ = is_too_soon(frame.rate) ? std::min(2 * patience_, kLongestPatience) : patience_;
    const int in_use = std::min(followed, limit_);
    limit_ = std::max(kLeast, in_use - std::max(1, in_use / 8));
    // What was shed takes effect from here on.
    overruns_ = 0;
    calm_ = 0;
    return true;
  }
  if (limit_ < maximum_ && calm_ >= frame.rate.frames(kCalm * patience_)) take_back();
  return false;
}

bool LoadSheddingDecision::is_too_soon(const FrameRate& rate) const noexcept {
  return since_taken_back_ < rate.frames(kTooSoon);
}

void LoadSheddingDecision::take_back() noexcept {
  limit_ = std::min(maximum_, limit_ + std::max(1, maximum_ / 16));
  calm_ = 0;
  since_taken_back_ = 0;
  if (limit_ == maximum_) patience_ = 1;
}

LoadShedding::LoadShedding(std::span<FeatureSlot> slots) : slots_(slots), watches_(slots.size()) {
  order_.reserve(slots.size());
}

int LoadShedding::followed() const noexcept {
  return static_cast<int>(std::count_if(slots_.begin(), slots_.end(), [](const FeatureSlot& slot) {
    return slot.state != SlotState::kEmpty && !slot.shed;
  }));
}

int LoadShedding::in_sight() const noexcept {
  int seen = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].state != SlotState::kEmpty && sight_of(slots_[i], watches_[i]) == kSeen) ++seen;
  }
  return seen;
}

int LoadShedding::sight_of(const FeatureSlot& slot, const Watch& watch) const noexcept {
  if (!slot.shed) {
    if (watch.misses <= rate_.frames(kMissesAllowed)) return kSeen;
    return slot.in_view ? kPerhapsSeen : kUnseen;
  }
  if (slot.state != SlotState::kMapped || !slot.in_view) return kUnseen;
  return watch.set_aside > 0 ? kPerhapsSeen : kSeen;
}

bool LoadShedding::more_useful(const Ranked& a, const Ranked& b) noexcept {
  if (a.sight != b.sight) return a.sight > b.sight;
  if (usefulness(*a.slot) != usefulness(*b.slot)) return usefulness(*a.slot) > usefulness(*b.slot);
  if (a.slot->shed != b.slot->shed) return b.slot->shed;
  // Without a map there is no deviation yet.
  if (a.slot->state == SlotState::kMapped && a.slot->largest_deviation_mm != b.slot->largest_deviation_mm) {
    return a.slot->largest_deviation_mm < b.slot->largest_deviation_mm;
  }
  return a.slot->id < b.slot->id;
}

void LoadShedding::note(std::uint64_t frame_index, bool measurable, const FrameRate& rate) noexcept {
  rate_ = rate;
  ++since_ranked_;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    const FeatureSlot& slot = slots_[i];
    Watch& watch = watches_[i];
    if (slot.state == SlotState::kEmpty || slot.id != watch.id) watch = {};
    watch.id = slot.id;
    if (slot.state == SlotState::kEmpty) continue;
    watch.set_aside = (slot.shed && !slot.in_view) || watch.set_aside == 0 ? 0 : watch.set_aside - 1;
    if (slot.shed) continue;
    if (slot.last_found_frame == frame_index) {
      watch.misses = 0;
    } else if (measurable) {
      ++watch.misses;
    }
  }
}

std::size_t LoadShedding::apply(int limit) noexcept {
  order_.clear();
  std::size_t shed = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    FeatureSlot& slot = slots_[i];
    if (slot.state == SlotState::kEmpty) continue;
    order_.push_back({&slot, &watches_[i], sight_of(slot, watches_[i])});
    shed += slot.shed ? 1 : 0;
  }
  const std::size_t keep = std::min(order_.size(), static_cast<std::size_t>(std::max(0, limit)));
  const bool as_many = order_.size() - shed == keep;
  if (as_many && (shed == 0 || since_ranked_ < rate_.frames(kReview))) return shed;
  since_ranked_ = 0;
  std::nth_element(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(keep), order_.end(), &more_useful);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const auto [slot, watch, sight] = order_[i];
    const bool sheds = i >= keep;
    if (sheds && !slot->shed && sight != kSeen) watch->set_aside = rate_.frames(kSetAside);
    if (!sheds && slot->shed) watch->misses = 0;
    slot->shed = sheds;
  }
  return order_.size() - keep;
}

}  // namespace perimap
