#include "core/pipeline/patch_watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace perimap {
namespace {

// What is told fades to 1/e in this time: shorter than what would let a feature's own filter follow, longer than what a
// match and the next have in common.
constexpr double kMemory_s = 0.7;
// A match that lies farther off than that does not tell more.
constexpr double kLargest_deviations = 5.0;
// What it is looked for within.
constexpr double kLooked_mm = 3.0;
// A phase that is not known puts the heart elsewhere in its motion, each place otherwise.
constexpr double kUnsurePhase_s = 0.02;
// What was not seen for so long is not asked.
constexpr Duration kSeenLately = std::chrono::milliseconds(500);

// What is pressed in with a tip or a finger, and what an instrument's shaft or a hand presses.
constexpr std::array kRadii_mm = {12.0, 20.0};
constexpr int kFewestFeatures = 4;
// Beyond chance, without any one of the features too: see docs/decisions/0173. What seems to be off by more is no dent:
// matches of something else.
constexpr double kDoubt_chi2 = 25.0;
constexpr double kDoubtOfOthers_chi2 = 15.0;
constexpr double kDoubt_mm = 1.5;
constexpr double kMost_mm = 12.0;
// Let go.
constexpr double kBack_mm = 1.0;
constexpr double kBack_chi2 = 12.0;
constexpr Duration kBackFor = std::chrono::milliseconds(500);
// Whatever nobody sees any more is no patch.
constexpr Duration kForgotten = std::chrono::seconds(30);
// It had begun before it was told.
constexpr Duration kBegan = std::chrono::milliseconds(1000);
// Places asked in one frame; the others in the next ones.
constexpr std::size_t kAsked = 48;

}  // namespace

PatchWatch::PatchWatch(std::span<FeatureSlot> slots) : slots_(slots) { features_.reserve(slots.size()); }

void PatchWatch::watch(const FrameRecord& frame, const FrameHistory& history) noexcept {
  gather(frame);
  follow_patches(frame.stamp.capture);
  look_for_patches(frame.stamp.capture);
  mark(frame, history);
}

void PatchWatch::gather(const FrameRecord& frame) noexcept {
  const Instant now = frame.stamp.capture;
  const bool sure = frame.measurable && !frame.phase.ectopic && !frame.phase.law_undecided &&
                    frame.phase.deviation_s <= kUnsurePhase_s;
  features_.clear();
  for (FeatureSlot& slot : slots_) {
    if (slot.state != SlotState::kMapped) continue;
    const BesideMatch& beside = slot.beside;
    if (sure && beside.frame_index == frame.index && beside.told) {
      slot.off_map.fade(std::exp(-to_seconds(now - slot.off_map_at) / kMemory_s));
      slot.off_map_at = now;
      slot.place_W_mm = beside.p_W_mm;
      slot.placed = true;
      const Matrix2d wide =
          beside.R + beside.J * (beside.S + kLooked_mm * kLooked_mm * Matrix3d::Identity()) * beside.J.transpose();
      const double deviations = std::sqrt(std::max(beside.r.dot(wide.inverse() * beside.r), 1e-12));
      slot.off_map.add(beside.r, beside.J, beside.R,
                       frame.rate.of_usual() * std::min(1.0, kLargest_deviations / deviations));
    }
    const bool known = slot.converged || slot.pressed;
    if (!known || !slot.placed || now - slot.off_map_at > kSeenLately) continue;
    features_.push_back({slot.place_W_mm, beside_map(slot.off_map, beside.S)});
  }
}

void PatchWatch::follow_patches(Instant now) noexcept {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    Patch& patch = patches_[i];
    const LocalDisplacement seen = local_displacement(features_, patch.place_W_mm, patch.radius_mm);
    const bool back = seen.features >= kFewestFeatures && (seen.size_mm < kBack_mm || seen.chi2 < kBack_chi2);
    if (!back && seen.features >= kFewestFeatures) patch.displaced = now;
    if (back && now - patch.displaced > kBackFor) continue;
    if (now - patch.displaced > kForgotten) continue;
    patch.chi2 = seen.chi2;
    patches_[kept++] = patch;
  }
  count_ = kept;
}

void PatchWatch::look_for_patches(Instant now) noexcept {
  const std::size_t asked = std::min(kAsked, features_.size());
  for (std::size_t i = 0; i < asked; ++i) {
    next_ = next_ + 1 < features_.size() ? next_ + 1 : 0;
    const Vector3d& place = features_[next_].p_W_mm;
    for (const double radius_mm : kRadii_mm) {
      const LocalDisplacement seen = local_displacement(features_, place, radius_mm);
      if (seen.features < kFewestFeatures || seen.chi2 < kDoubt_chi2 || seen.chi2_of_others < kDoubtOfOthers_chi2)
        continue;
      if (seen.size_mm < kDoubt_mm || seen.size_mm > kMost_mm) continue;
      take({place, radius_mm, now, seen.chi2});
    }
  }
}

// One that overlaps it is the same, and lies where most speaks for it.
void PatchWatch::take(const Patch& found) noexcept {
  const auto end = patches_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto same = std::find_if(patches_.begin(), end, [&found](const Patch& patch) {
    return (patch.place_W_mm - found.place_W_mm).norm() < std::max(patch.radius_mm, found.radius_mm);
  });
  if (same == end) {
    if (count_ < kMostPatches) patches_[count_++] = found;
    return;
  }
  if (found.chi2 <= same->chi2) return;
  same->place_W_mm = found.place_W_mm;
  same->radius_mm = found.radius_mm;
  same->chi2 = found.chi2;
}

bool PatchWatch::is_in_a_patch(const Vector3d& p_W_mm) const noexcept {
  return std::any_of(patches_.begin(), patches_.begin() + static_cast<std::ptrdiff_t>(count_),
                     [&](const Patch& patch) { return (patch.place_W_mm - p_W_mm).norm() < patch.radius_mm; });
}

// What was held of a patch's features since it began is not learnt.
void PatchWatch::mark(const FrameRecord& frame, const FrameHistory& history) noexcept {
  const std::uint64_t began = history.first_since(frame.stamp.capture - kBegan);
  for (FeatureSlot& slot : slots_) {
    if (slot.state != SlotState::kMapped) continue;
    const bool pressed = slot.placed && is_in_a_patch(slot.place_W_mm);
    if (pressed && !slot.pressed) {
      slot.pressed_since = frame.stamp.capture;
      slot.held.drop_if([began](const HeldMatch& held) { return held.frame_index >= began; });
    }
    slot.pressed = pressed;
  }
}

void PatchWatch::forget() noexcept {
  count_ = 0;
  for (FeatureSlot& slot : slots_) {
    slot.off_map = {};
    slot.placed = false;
    slot.pressed = false;
  }
}

}  // namespace perimap
