// Which places of the surface are displaced from where the map has them, while the rest is not: a dent, or whatever
// presses or pulls at one place.
//
// The features there are not called converged, teach nothing and are asked nothing that all features are asked; the
// others go on. So the map keeps what it knew of the place, which is good again when it is let go.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/estimation/local_displacement.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// All members are called by the mapper thread while no worker learns; nothing is allocated after construction.
class PatchWatch {
 public:
  static constexpr std::size_t kMostPatches = 4;

  // They outlive it.
  explicit PatchWatch(std::span<FeatureSlot> slots);

  // Once a frame, when its matches are settled and before they are held: what they were off by beside the pose that
  // they agree on (FeatureSlot::beside). Slots that lie in a displaced patch are `pressed` from then on.
  void watch(const FrameRecord& frame, const FrameHistory& history) noexcept;

  // That are displaced now.
  [[nodiscard]] std::size_t patches() const noexcept { return count_; }

  // Another map, or one that was moved.
  void forget() noexcept;

 private:
  struct Patch {
    Vector3d place_W_mm = Vector3d::Zero();
    double radius_mm = 0.0;
    Instant displaced;  // when that was told last
    double chi2 = 0.0;  // as this frame has it
  };

  void gather(const FrameRecord& frame) noexcept;
  void follow_patches(Instant now) noexcept;
  void look_for_patches(Instant now) noexcept;
  void take(const Patch& found) noexcept;
  void mark(const FrameRecord& frame, const FrameHistory& history) noexcept;
  [[nodiscard]] bool is_in_a_patch(const Vector3d& p_W_mm) const noexcept;

  std::span<FeatureSlot> slots_;
  std::vector<OffFeature> features_;  // that tell anything in this frame
  std::size_t next_ = 0;              // of features_, to be asked next
  std::array<Patch, kMostPatches> patches_{};
  std::size_t count_ = 0;
};

}  // namespace perimap
