// One published surface, as the pipeline makes it; the daemon puts it into the wire type of idl/perimap.idl.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/pixel_map.hpp"
#include "core/geometry/pose.hpp"
#include "core/pipeline/release_schedule.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The meaning of each value is written in idl/perimap.idl.
enum class SurfaceState : std::uint8_t { kInvalid, kDegraded, kGood };
enum class SurfaceReason : std::uint8_t {
  kNone,
  kNothingMapped,
  kPhaseUnknown,
  kPhaseFreeRunning,
  kPhaseLost,
  kFrameMissing,
  kUpdateLate,
  kPoseMissing,
  kPhaseContradicted,
  kRespirationUnknown,
  kPhaseFromImage,
  kEctopicBeat,
  kRhythmUnpredictable,
  kRhythmEctopic,
  kLawUndecided,
  kNotSeen,
  kNoParallax,
  kSetupDoubted,
  kNothingConverged,
  kScopeUnread,
  kScopeChanged,
  kPoseRepeated,
  kPictureRepeated,
  kOrganOrTrackerMoved,
  kOrganMoved,
  kTrackerErrs,
  kSetupUncertain
};
enum class FeatureState : std::uint8_t { kInvalid, kConverging, kConverged, kInconsistent };
enum class FeatureReason : std::uint8_t { kNone, kNotObserved, kDeviationLarge, kInnovationsHigh, kPhaseLost, kShed };

// To show it, to measure in it, to act in contact with it.
enum class SurfaceUse : std::uint8_t { kDisplay, kMeasure, kContact };
inline constexpr std::size_t kUses = 3;
// By SurfaceUse: 95 % of errors are to be within so much, mm.
using UseBounds = std::array<double, kUses>;
struct UseVerdict {
  SurfaceState state = SurfaceState::kInvalid;
  std::uint32_t features = 0;  // that are converged and within the bound
};
using UseVerdicts = std::array<UseVerdict, kUses>;

struct SurfaceFeature {
  std::uint32_t id = 0;
  FeatureState state = FeatureState::kInvalid;
  FeatureReason reason = FeatureReason::kNone;
  Vector3d p_WF_mm = Vector3d::Zero();              // at the valid time
  Vector3d velocity_W_mm_per_s = Vector3d::Zero();  // at the valid time
  Matrix3d covariance_W_mm2 = Matrix3d::Zero();     // of the position, phase deviation included
  Instant last_observed;                            // capture of the last match that agreed with the map
};

// Where the camera was, when that is known, and how its picture was scaled and moved.
struct CameraPlace {
  bool known = false;
  Pose X_WC;
  PictureLens lens = {};
};

struct SurfaceSample {
  std::uint64_t sample_sequence = 0;
  Release release;  // its frame and capture are those that the sample belongs to, whichever its stream
  Instant valid_time;
  Instant valid_until;
  SurfaceState state = SurfaceState::kInvalid;
  SurfaceReason reason = SurfaceReason::kNone;
  std::uint64_t oldest_shard_frame_sequence = 0;
  bool update_late = false;  // the frame came, its update was not ready: predicted from the state before
  double cardiac_phase_rad = 0.0;
  double cardiac_phase_deviation_rad = 0.0;
  double cardiac_phase_rate_rad_per_s = 0.0;
  CameraPlace camera;  // at the release's capture
  UseBounds use_within_mm{};
  UseVerdicts uses;                      // see surface_use.hpp
  std::vector<SurfaceFeature> features;  // in order of id; capacity reserved at start
};

}  // namespace perimap
