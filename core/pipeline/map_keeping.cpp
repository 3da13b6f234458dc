#include "core/pipeline/map_keeping.hpp"

#include <algorithm>

#include "core/pipeline/feature_stages.hpp"

namespace perimap {

void MapKeeping::fill_feed(const Known& known, std::uint64_t maps_ended) noexcept {
  MapFeed::Batch* batch = feed_.back();
  if (batch == nullptr) return;
  batch->maps_ended = maps_ended;
  batch->respiration = known.breathing.memory();
  batch->law = known.heart.law_memory();
  batch->setup = known.setup.memory();
  for (MapFeed::Entry& entry : batch->entries) {
    entry.slot = next_fed_slot_;
    next_fed_slot_ = (next_fed_slot_ + 1) % slots_.size();
    const FeatureSlot& slot = slots_[entry.slot];
    entry.mapped = slot.state == SlotState::kMapped && slot.health.state() != HealthState::kInconsistent;
    if (!entry.mapped) continue;
    remember(slot, entry.feature);
    bank_.get(static_cast<int>(entry.slot), entry.feature.estimate);
    add_lasting_errors(slot, entry.feature.estimate.P);
    entry.feature.breathing = known.breathing.begun();
  }
  feed_.hand_over();
}

void MapKeeping::remember(const FeatureSlot& slot, FeatureMemory& feature) const noexcept {
  feature.id = slot.id;
  feature.first_observed = slot.first_observed;
  feature.first_observed_px = slot.first_observed_px;
  feature.last_observed = slot.last_observed;
  feature.patch = slot.patch;
  feature.patch_state = slot.patch_state;
  feature.updates = slot.updates;
  feature.converged = slot.converged;
  feature.largest_deviation_mm = slot.largest_deviation_mm;
}

std::uint32_t MapKeeping::recall(std::span<const FeatureMemory> features, const Breathing& breathing) noexcept {
  std::uint32_t largest_id = 0;
  std::size_t index = 0;
  for (const FeatureMemory& feature : features) {
    if (index >= slots_.size()) break;
    if (feature.estimate.x.size() != bank_.layout().state_size()) continue;
    recall(slots_[index], feature);
    bank_.set(static_cast<int>(index), feature.estimate);
    // Taken before breathing was found, and not again since.
    if (breathing.begun() && !feature.breathing) {
      groups_[index / kLanes].begin_breath(index % kLanes, breathing.wave());
    }
    largest_id = std::max(largest_id, feature.id);
    ++index;
  }
  return largest_id;
}

void MapKeeping::recall(FeatureSlot& slot, const FeatureMemory& feature) noexcept {
  slot.follow({.id = feature.id,
               .first_observed = feature.first_observed,
               .first_observed_px = feature.first_observed_px,
               .patch = feature.patch,
               .patch_state = feature.patch_state,
               .carried_px = feature.patch_state.px,
               // So that the map alone tells where to look.
               .last_found_frame = std::uint64_t{0} - kFramesLongAgo});
  slot.map({.last_observed = feature.last_observed,
            .last_learnt = feature.last_observed,
            .updates = feature.updates,
            .aside = SeenFromAside(feature.converged),
            .largest_deviation_mm = feature.largest_deviation_mm,
            .converged = feature.converged,
            .recalled_converged = feature.converged});
}

void MapKeeping::displace(const Pose& X, double deviation_mm) noexcept {
  constexpr double kLeastDoubt_mm = 0.5;
  const double doubt_mm = std::max(kLeastDoubt_mm, deviation_mm);
  const int n = bank_.layout().size();
  FeatureEstimate estimate;
  for (std::size_t index = 0; index < slots_.size(); ++index) {
    FeatureSlot& slot = slots_[index];
    if (slot.state == SlotState::kStarting) slot.forgotten = true;
    if (slot.state != SlotState::kMapped) continue;
    const int feature = static_cast<int>(index);
    bank_.get(feature, estimate);
    const auto axes = [n](int i) { return Eigen::seqN(i, 3, n); };
    for (int i = 0; i < n; ++i) estimate.x(axes(i)) = Vector3d(X.R * Vector3d(estimate.x(axes(i))));
    estimate.x(axes(0)) += X.t;
    for (int i = 0; i < n; ++i) {
      // Both halves from one product, so that it stays symmetric bit by bit.
      for (int j = 0; j <= i; ++j) {
        const Matrix3d block = X.R * Matrix3d(estimate.P(axes(i), axes(j))) * X.R.transpose();
        const Matrix3d kept = i == j ? Matrix3d(0.5 * (block + block.transpose())) : block;
        estimate.P(axes(i), axes(j)) = kept;
        estimate.P(axes(j), axes(i)) = kept.transpose();
      }
    }
    bank_.set(feature, estimate);
    bank_.diffuse(feature, doubt_mm);
    slot.repeated.fade(slot.largest_deviation_mm, doubt_mm);
  }
}

void MapKeeping::forget() noexcept {
  for (std::size_t index = 0; index < slots_.size(); ++index) {
    FeatureSlot& slot = slots_[index];
    if (slot.state == SlotState::kStarting) {
      slot.forgotten = true;
    } else if (slot.state != SlotState::kEmpty) {
      slot.clear();
      bank_.clear(static_cast<int>(index));
    }
  }
}

}  // namespace perimap
