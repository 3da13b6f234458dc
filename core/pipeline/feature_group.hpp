// Eight slots and the group of the bank that holds their estimates: what a worker does with all of them at once.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/estimation/measurement_model.hpp"
#include "core/estimation/shared_pose.hpp"
#include "core/phase/respiration_search.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/feature_stages.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {

// Frames learnt from per group and frame. A cycle's matches wait for the R peak that ends it; then they drain over some
// frames, without a burst.
inline constexpr int kLearnPerFrame = 3;
static_assert(kLearnPerFrame <= kMaxLearntPhases && kLearnPerFrame <= kMaxPendingUpdates);
static_assert(kLearnPerFrame + 1 + static_cast<int>(kCovariances) <= kMaxSweepPhases);

// What one sweep serves: held frames to learn from, this frame's capture, the releases to come.
struct SweepPlan {
  SweepPhases<double> phases;
  std::array<const FrameRecord*, kLearnPerFrame> learnt{};  // the frames of the learnt phases, oldest first
  int capture = -1;                                         // the phases' numbers; -1: the group has no estimate
  std::array<int, kCovariances> evaluated{};
};

// Whose matches are asked for what all have in common.
enum class Asked : std::uint8_t {
  kMapped,
  kConverged,
  kWellKnown  // those too that have been converged, or would be, were their innovations not too high
};

[[nodiscard]] bool is_asked(const FeatureSlot& slot, Asked asked) noexcept;

class FeatureGroup {
 public:
  // Slot l of at most kLanes is lane l of the bank's group `index`. Both must outlive this.
  FeatureGroup(MapBank& bank, int index, std::span<FeatureSlot> slots) noexcept
      : bank_(bank), index_(index), slots_(slots) {}

  [[nodiscard]] std::span<FeatureSlot> slots() const noexcept { return slots_; }
  [[nodiscard]] int feature(std::size_t lane) const noexcept { return index_ * kLanes + static_cast<int>(lane); }

  // A, before the search: plans the frame's sweep and makes it.
  void sweep(const FrameJob& job) noexcept;
  // After sweep().
  [[nodiscard]] MapPrediction prediction(std::size_t lane) const noexcept;

  // B: appends what the features that were found say of the frame's pose, and of its phases near `at`: the velocity
  // (mm/s) there, and that of breathing at `breath` unless it is null, are the appended motions. Only converged
  // features are asked when `converged`. `picture`: the frame's. owners[k] becomes the slot of matches[k].
  void collect(const SweepPhase<double>& at, const SweepPhase<double>* breath, Asked asked, double pixel_deviation_px,
               const PixelMap& picture, std::vector<CommonMatch>& matches, std::vector<FeatureSlot*>& owners) noexcept;
  // The breathing's phase has become known: all mapped features take the motion that they have in common with it and,
  // when `again`, learn once more what the frame history still has, by that phase. As long as it was not known a match
  // was worth hardly anything beside what it is now, so that none counts twice.
  void begin_breath(const BreathWave& wave, bool again) noexcept;
  // The images have corrected the breathing's rate, and its phase in the frame history: what that has is learnt again.
  void learn_again() noexcept;
  // begin_breath() for one lane, whose feature is mapped; from then on.
  void begin_breath(std::size_t lane, const BreathWave& wave) noexcept;

  // The motion law was another one than supposed: what was learnt under it is less certain than it seemed.
  void doubt() noexcept;

  // C: appends the snapshots of the mapped features to both.
  void evaluate(const FrameJob& job, ShardSnapshot& publisher, ShardSnapshot& model) noexcept;

  // D, after hold_match(): learns the held matches of the planned frames, whose cycles are completed, so that their
  // phases are known. What is left of the phase's deviation counts as noise along the motion: R + J v v^T J^T
  // sigma_t^2.
  void learn(const PixelModel& model, const EstimatorSettings& settings) noexcept;

 private:
  void plan(const FrameJob& job) noexcept;
  void follow_slow_errors(const PixelModel& model, int k, const LaneOutcomes<double>& outcomes,
                          const std::array<Matrix2d, kLanes>& R) noexcept;
  // More is to be learnt of the lane's feature than its covariance says.
  void diffuse(std::size_t lane, double deviation_mm) noexcept;
  void judge(std::size_t lane, double nis, bool accepted, double common, const FrameRate& held_rate) noexcept;

  MapBank& bank_;
  int index_;
  std::span<FeatureSlot> slots_;
  SweepPlan plan_;
  LaneMotions<double> at_capture_;  // without the phase's deviation
  LaneMotions<double> earlier_;     // by one deviation of the phase
  LaneMotions<double> later_;
};

}  // namespace perimap
