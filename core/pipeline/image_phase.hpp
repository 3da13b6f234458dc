// Stage B: the phases and the camera pose that all matches of a frame agree on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/estimation/measurement_model.hpp"
#include "core/estimation/shared_pose.hpp"
#include "core/phase/image_phase_answer.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {

// What a frame's matches tell.
struct ImagePhases {
  ImagePhaseAnswer cardiac;
  ImagePhaseAnswer respiratory;  // kCanNotTell too where breathing is not known
};

// An error of the phase moves every feature along its velocity, one of the pose moves them all alike; both explain the
// same innovations, so they are estimated together, the tracker being the pose's prior. Each match weighs by how well
// its feature is known. The surface turns its direction within some 30 ms, so the features are moved to the phase found
// and the rest is estimated again.
//
// Where they agree, a match of any mapped feature that does not is refused: a tracker's noise widens every search
// region to where look-alikes are, and the pose that all matches have in common is known far better.
//
// No answer is better than a wrong one: it is tentative when fewer than kFewestMatches converged features were found,
// and there is none when fewer mapped ones were or when the heart stands too still to tell. When fewer than half of the
// matches agree on a solution near the prediction, that is said: the heart is elsewhere than predicted, or something
// else moves in the view.
class ImagePhase {
 public:
  static constexpr int kFewestMatches = 8;
  // More would hardly tell more, and this stands before the release: of more groups every other, third... is asked, the
  // next ones in the next frame.
  static constexpr std::size_t kMostGroups = 16;

  ImagePhase() {
    matches_.reserve(kMostGroups * kLanes);
    used_.reserve(kMostGroups * kLanes);
    owners_.reserve(kMostGroups * kLanes);
  }

  // After stage A. frame.phase need not be right by more than some tens of milliseconds.
  [[nodiscard]] ImagePhases observe(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                                    const EstimatorSettings& settings) noexcept;

  // The pose that the converged features' matches of the frame observed last agree on; null when they did not tell it.
  [[nodiscard]] const CommonEstimate* shared_pose() const noexcept { return agreed_.ok ? &agreed_ : nullptr; }

  // The camera pose that the converged features' matches tell together, beside that of the frame, whose error is taken
  // for as wide as `searched` has it. After observe().
  struct Together {
    bool told = false;  // false: too few, or most of them do not agree on any
    CommonEstimate estimate;
    // Of those features: their middle, their root mean square distance from it, and how far off each axis the map is
    // said to be there.
    Vector3d centre_W_mm = Vector3d::Zero();
    double spread_mm = 0.0;
    double map_variance_mm2 = 0.0;
  };
  [[nodiscard]] Together together(std::span<FeatureGroup> groups, const FrameRecord& frame, const CameraPose& searched,
                                  const PixelModel& model, const EstimatorSettings& settings) noexcept;

  // By how much the whole surface is displaced from where the map has it (mm, frame W), which may be much more than the
  // tracker's error. False when the matches can not tell.
  [[nodiscard]] bool displacement(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                                  const EstimatorSettings& settings, Vector3d& displacement_mm) noexcept;

 private:
  // By how much the phases are taken off those of the frame, s.
  struct Shifts {
    double cardiac = 0.0;
    double breath = 0.0;
  };
  void collect(std::span<FeatureGroup> groups, const FrameRecord& frame, const EstimatorSettings& settings,
               const Shifts& shifts, Asked asked) noexcept;
  // `solved`: of what was collected at `shifts`.
  void refuse_what_disagrees(std::span<FeatureGroup> groups, const FrameRecord& frame, const PixelModel& model,
                             const EstimatorSettings& settings, const Shifts& shifts,
                             const CommonEstimate& solved) noexcept;

  CommonEstimate agreed_;
  Shifts observed_;  // of the frame observed last; zero where it told none
  std::vector<CommonMatch> matches_;
  std::vector<FeatureSlot*> owners_;  // of matches_
  std::vector<std::uint8_t> used_;
};

// The covariance of a camera pose's error [theta, delta_c] as estimate_shared_pose() has it: that of the sensor,
// carried over to the camera. And what it is as a prior.
[[nodiscard]] Matrix6d camera_error_covariance(const CameraPose& pose) noexcept;
[[nodiscard]] CommonInformation pose_prior(const CameraPose& pose) noexcept;

}  // namespace perimap
