#include "core/pipeline/surface_state.hpp"

#include <algorithm>

#include "core/pipeline/sight.hpp"

namespace perimap {

namespace {

SurfaceReason reason_of(DisplacedCause cause) noexcept {
  switch (cause) {
    case DisplacedCause::kOrgan:
      return SurfaceReason::kOrganMoved;
    case DisplacedCause::kTracker:
      return SurfaceReason::kTrackerErrs;
    case DisplacedCause::kUnknown:
      break;
  }
  return SurfaceReason::kOrganOrTrackerMoved;
}

bool is_converged(const FeatureSnapshot& feature) noexcept { return feature.state == FeatureState::kConverged; }

bool is_held_back(const FeatureSnapshot& feature) noexcept { return feature.held_back; }

}  // namespace

SurfaceFooting footing_of(std::span<const ShardSnapshot* const> snapshots) noexcept {
  SurfaceFooting footing;
  Sight sight;
  bool converged = false;
  for (const ShardSnapshot* snapshot : snapshots) {
    footing.mapped = footing.mapped || !snapshot->features.empty();
    footing.pose_missing = footing.pose_missing || snapshot->pose_missing;
    footing.doubts.add(snapshot->doubts);
    sight.add(*snapshot);
    converged = converged || std::any_of(snapshot->features.begin(), snapshot->features.end(), is_converged);
    footing.held_back =
        footing.held_back || std::any_of(snapshot->features.begin(), snapshot->features.end(), is_held_back);
  }
  footing.no_parallax = footing.doubts.still && !converged;
  footing.converged = converged;
  footing.not_seen = sight.lost();
  return footing;
}

SurfaceReason reason_of(const PhaseEstimate& phase, Rhythm rhythm, const SurfaceFooting& footing) noexcept {
  if (phase.state == PhaseState::kUnknown) return SurfaceReason::kPhaseUnknown;
  if (phase.state == PhaseState::kLost) return SurfaceReason::kPhaseLost;
  if (!footing.mapped) return SurfaceReason::kNothingMapped;
  // A set-up that is off displaces the surface as breathing may, and so does whoever moves the organ.
  const bool displaced_otherwise = footing.doubts.setup_doubted || footing.doubts.displaced;
  if (footing.breath_doubtful && !displaced_otherwise) return SurfaceReason::kRespirationUnknown;
  if (phase.state == PhaseState::kFreeRunning) return SurfaceReason::kPhaseFreeRunning;
  // The images show another phase than the map has where they show the map elsewhere.
  if (phase.contradicted && !footing.doubts.displaced) return SurfaceReason::kPhaseContradicted;
  if (phase.state == PhaseState::kFromImage) return SurfaceReason::kPhaseFromImage;
  if (footing.frame_missing) return SurfaceReason::kFrameMissing;
  if (footing.update_late) return SurfaceReason::kUpdateLate;
  if (footing.doubts.picture_repeated) return SurfaceReason::kPictureRepeated;
  if (footing.doubts.scope_unread) return SurfaceReason::kScopeUnread;
  if (footing.doubts.scope_changed) return SurfaceReason::kScopeChanged;
  if (footing.doubts.pose_repeated) return SurfaceReason::kPoseRepeated;
  if (footing.pose_missing) return SurfaceReason::kPoseMissing;
  if (footing.doubts.setup_doubted) return SurfaceReason::kSetupDoubted;
  if (footing.doubts.displaced) return reason_of(footing.doubts.cause);
  if (footing.not_seen) return SurfaceReason::kNotSeen;
  // What a map lacks that was just moved with the organ, it lacks for that.
  const bool settling = footing.doubts.settling;
  if (footing.doubts.unproven) return settling ? SurfaceReason::kOrganMoved : SurfaceReason::kNotSeen;
  if (footing.no_parallax) return SurfaceReason::kNoParallax;
  if (!footing.converged && settling) return SurfaceReason::kOrganMoved;
  if (!footing.converged) return footing.held_back ? SurfaceReason::kSetupUncertain : SurfaceReason::kNothingConverged;
  if (phase.ectopic) return SurfaceReason::kEctopicBeat;
  if (rhythm == Rhythm::kUnpredictable) return SurfaceReason::kRhythmUnpredictable;
  if (rhythm == Rhythm::kEctopic) return SurfaceReason::kRhythmEctopic;
  if (phase.law_undecided) return SurfaceReason::kLawUndecided;
  return SurfaceReason::kNone;
}

bool is_accounted_for(const PhaseEstimate& phase, Rhythm rhythm, SurfaceFooting footing) noexcept {
  PhaseEstimate carried = phase;
  const bool predicted = phase.state == PhaseState::kFreeRunning || phase.state == PhaseState::kFromImage;
  if (predicted) carried.state = PhaseState::kLocked;
  footing.frame_missing = footing.update_late = footing.pose_missing = false;
  return reason_of(carried, rhythm, footing) == SurfaceReason::kNone;
}

SurfaceState state_of(SurfaceReason reason) noexcept {
  switch (reason) {
    case SurfaceReason::kNone:
      return SurfaceState::kGood;
    case SurfaceReason::kPhaseUnknown:
    case SurfaceReason::kPhaseLost:
    case SurfaceReason::kNothingMapped:
      return SurfaceState::kInvalid;
    default:
      return SurfaceState::kDegraded;
  }
}

FeatureVerdict verdict_of(const FeatureVerdict& own, PhaseState phase, const SurfaceFooting& footing) noexcept {
  if (!usable(phase)) return {FeatureState::kInvalid, FeatureReason::kPhaseLost};
  FeatureVerdict verdict = own;
  const bool elsewhere = footing.breath_doubtful || footing.doubts.setup_doubted || footing.doubts.displaced;
  if (elsewhere && verdict.state == FeatureState::kConverged) {
    verdict = {FeatureState::kConverging, FeatureReason::kDeviationLarge};
  }
  if (verdict.reason == FeatureReason::kNone && (footing.frame_missing || footing.update_late)) {
    verdict.reason = FeatureReason::kNotObserved;
  }
  return verdict;
}

}  // namespace perimap
