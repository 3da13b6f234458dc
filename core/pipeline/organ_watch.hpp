// Whether the organ is where the map has it, as far as the tracker's own error lets the matches tell.
//
// A common shift and turn of the features against the map is the same data whether the organ has been moved or the
// tracker errs by more than it was said to. Both mean that nothing is good; which of the two it is, the matches do not
// tell. Where the patient's reference tool is tracked, its own movement does.
#pragma once

#include <optional>
#include <span>

#include "core/estimation/common_displacement.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/image_phase.hpp"
#include "core/pipeline/patient_tool.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// A displaced organ that rests where it is.
struct RestingOrgan {
  Pose X;                     // maps the map's points to where they are
  double size_mm = 0.0;       // by how much, root mean square over the features that are seen
  double deviation_mm = 0.0;  // likewise of its error
};

//              a window's mean is beyond chance, and too large
//   at its place ───────────────────────────────────────────▶ displaced: nothing is learnt, the poses of frames are
//       ▲  ▲                                                   │     │   told as of the map that moves with the organ
//       │  └─ it is back: two windows' means are small again ──┘     │
//       └──── its tool, or whoever knows, says that the organ has been moved and rests: the map is moved with it
//
// Whether it is at its place is not known while nothing is seen: after some seconds of that, and when the map has been
// moved, it is asked anew.
//
// All members are called by the mapper thread; nothing is allocated.
class OrganWatch {
 public:
  // The settings outlive it.
  explicit OrganWatch(const PipelineSettings& settings) noexcept
      : model_{settings.camera},
        estimator_(settings.estimator),
        evidence_(settings.pose.error_correlation),
        tool_(settings.pose) {}

  // A reading of the patient's reference tool.
  void add_tool(const TrackerSample& sample) noexcept { tool_.add(sample); }

  // At a frame's beginning: the camera's pose by the map, which is displaced as was seen last; and how far around its
  // predictions the frame's features are searched for.
  [[nodiscard]] CameraPose pose_by_map(const CameraPose& told) noexcept;
  [[nodiscard]] double search_deviation_mm() const noexcept;

  // When a frame's matches are settled and no worker learns.
  void watch(ImagePhase& image, std::span<FeatureGroup> groups, const FrameRecord& frame) noexcept;

  [[nodiscard]] bool displaced() const noexcept { return displaced_.since.has_value(); }
  // Nothing has told since the map was moved, or out of sight, that the organ is where the map has it.
  [[nodiscard]] bool unproven() const noexcept { return known_.unproven; }
  // The map has been moved with the organ, and nothing has converged there since: that is why nothing is good.
  [[nodiscard]] bool settling() const noexcept { return known_.settling; }
  // Mapper, once a frame: whether some feature is called converged. Until one was, the map is no place yet that the
  // organ could have left.
  void note_converged(bool some) noexcept;
  // Captures from this one on are not to be learnt from; none: all are.
  [[nodiscard]] const std::optional<Instant>& displaced_since() const noexcept { return displaced_.since; }
  // Maps the map's points to where they are now.
  [[nodiscard]] Pose displacement() const noexcept { return perimap::displaced(displaced_.d, known_.pivot_W_mm); }

  // Where it is, once that is told well, by the last seconds, in which it has not moved.
  [[nodiscard]] const std::optional<RestingOrgan>& resting() const noexcept { return displaced_.resting; }

  // What the patient's tool tells of it.
  [[nodiscard]] DisplacedCause cause() const noexcept { return displaced_.cause; }
  // Where the organ is, once its tool has told that it was moved, and both rest: the map is to be moved there.
  [[nodiscard]] const std::optional<RestingOrgan>& carried() const noexcept { return displaced_.carried; }

  // By how much, root mean square over the features; 0 where it is not.
  [[nodiscard]] double size_mm() const noexcept { return displaced_.size_mm; }

  // The map has been moved with the organ.
  void begin_anew() noexcept;
  // Another map.
  void forget() noexcept;

 private:
  void count_sight(std::span<FeatureGroup> groups, Instant capture) noexcept;
  void judge(Instant now) noexcept;
  void look_for_displacement(Instant now) noexcept;
  void look_for_rest(Instant now) noexcept;
  void ask_tool(Instant now) noexcept;
  void look_for_rest_with_tool(Instant now) noexcept;
  [[nodiscard]] Vector3d centre_W_mm() const noexcept { return known_.pivot_W_mm + known_.surface.centre_mm; }
  void settle() noexcept;

  PixelModel model_;
  const EstimatorSettings& estimator_;
  CommonDisplacement evidence_;
  PatientTool tool_;

  // Of this map.
  struct Known {
    CameraPose told;  // of the frame at hand
    bool pivoted = false;
    Vector3d pivot_W_mm = Vector3d::Zero();
    DisplacedSurface surface;
    std::optional<Instant> seen;
    bool unproven = false;
    bool settling = false;
    bool converged = false;  // some feature was, once
  };
  // Since the organ was last where the map has it.
  struct Displaced {
    Vector6d d = Vector6d::Zero();
    double size_mm = 0.0;
    std::optional<Instant> since;
    std::optional<RestingOrgan> resting;
    std::optional<RestingOrgan> carried;
    DisplacedCause cause = DisplacedCause::kUnknown;
    Instant judged;       // the capture that `resting` goes up to
    int frames_lost = 0;  // in a row, of which most of the map was not found where it is
  };
  Known known_;
  Displaced displaced_;
};

}  // namespace perimap
