// How features that the finder has found come into empty slots, and what of each frame the finder gets to see.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// All members are called by the mapper thread while the workers are at rest. Nothing is allocated after construction.
class FeatureIntake {
 public:
  // Both must outlive it.
  FeatureIntake(std::span<FeatureSlot> slots, FeatureFinder& finder);

  // Before a frame's features are followed: what the finder has for it, at most `room` of it, under ids of their own.
  void adopt(std::uint64_t frame_index, int room) noexcept;
  // After they were: the frame, and how many of `room` more there are empty slots for.
  void offer(const FrameRecord& frame, const GreyImage& image, const ColourImage& colour, int room) noexcept;

  // What a template must be in these pictures.
  [[nodiscard]] const TemplateSettings& templates() const noexcept { return finder_.templates(); }
  // What is being found is not to be adopted.
  void discard_round() noexcept { finder_.discard_round(); }
  // Before the first frame: another run, `ago` before, gave ids up to this one, and some more since it was kept.
  void go_on_from(std::uint32_t largest_id, Duration ago) noexcept;

 private:
  std::span<FeatureSlot> slots_;
  FeatureFinder& finder_;
  std::uint32_t next_id_ = 1;
  std::vector<Vector2d> occupied_;
};

}  // namespace perimap
