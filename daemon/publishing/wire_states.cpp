#include "daemon/publishing/wire_states.hpp"

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/ecg_signal.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/setup_watch/setup_verdict.hpp"

namespace perimap {

perimap_SurfaceState to_wire(SurfaceState state) noexcept {
  switch (state) {
    case SurfaceState::kGood:
      return perimap_SURFACE_GOOD;
    case SurfaceState::kDegraded:
      return perimap_SURFACE_DEGRADED;
    case SurfaceState::kInvalid:
      return perimap_SURFACE_INVALID;
  }
  return perimap_SURFACE_INVALID;
}

perimap_SurfaceReason to_wire(SurfaceReason reason) noexcept {
  switch (reason) {
    case SurfaceReason::kNone:
      return perimap_SURFACE_REASON_NONE;
    case SurfaceReason::kNothingMapped:
      return perimap_SURFACE_REASON_NOTHING_MAPPED;
    case SurfaceReason::kPhaseUnknown:
      return perimap_SURFACE_REASON_PHASE_UNKNOWN;
    case SurfaceReason::kPhaseFreeRunning:
      return perimap_SURFACE_REASON_PHASE_FREE_RUNNING;
    case SurfaceReason::kPhaseLost:
      return perimap_SURFACE_REASON_PHASE_LOST;
    case SurfaceReason::kFrameMissing:
      return perimap_SURFACE_REASON_FRAME_MISSING;
    case SurfaceReason::kUpdateLate:
      return perimap_SURFACE_REASON_UPDATE_LATE;
    case SurfaceReason::kPoseMissing:
      return perimap_SURFACE_REASON_POSE_MISSING;
    case SurfaceReason::kPhaseContradicted:
      return perimap_SURFACE_REASON_PHASE_CONTRADICTED;
    case SurfaceReason::kRespirationUnknown:
      return perimap_SURFACE_REASON_RESPIRATION_UNKNOWN;
    case SurfaceReason::kPhaseFromImage:
      return perimap_SURFACE_REASON_PHASE_FROM_IMAGE;
    case SurfaceReason::kEctopicBeat:
      return perimap_SURFACE_REASON_ECTOPIC_BEAT;
    case SurfaceReason::kRhythmUnpredictable:
      return perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE;
    case SurfaceReason::kRhythmEctopic:
      return perimap_SURFACE_REASON_RHYTHM_ECTOPIC;
    case SurfaceReason::kLawUndecided:
      return perimap_SURFACE_REASON_LAW_UNDECIDED;
    case SurfaceReason::kNotSeen:
      return perimap_SURFACE_REASON_NOT_SEEN;
    case SurfaceReason::kNoParallax:
      return perimap_SURFACE_REASON_NO_PARALLAX;
    case SurfaceReason::kSetupDoubted:
      return perimap_SURFACE_REASON_SETUP_DOUBTED;
    case SurfaceReason::kNothingConverged:
      return perimap_SURFACE_REASON_NOTHING_CONVERGED;
    case SurfaceReason::kScopeUnread:
      return perimap_SURFACE_REASON_SCOPE_UNREAD;
    case SurfaceReason::kScopeChanged:
      return perimap_SURFACE_REASON_SCOPE_CHANGED;
    case SurfaceReason::kPoseRepeated:
      return perimap_SURFACE_REASON_POSE_REPEATED;
    case SurfaceReason::kPictureRepeated:
      return perimap_SURFACE_REASON_PICTURE_REPEATED;
    case SurfaceReason::kOrganOrTrackerMoved:
      return perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED;
    case SurfaceReason::kOrganMoved:
      return perimap_SURFACE_REASON_ORGAN_MOVED;
    case SurfaceReason::kTrackerErrs:
      return perimap_SURFACE_REASON_TRACKER_ERRS;
    case SurfaceReason::kSetupUncertain:
      return perimap_SURFACE_REASON_SETUP_UNCERTAIN;
  }
  return perimap_SURFACE_REASON_NOTHING_MAPPED;
}

perimap_FeatureState to_wire(FeatureState state) noexcept {
  switch (state) {
    case FeatureState::kConverged:
      return perimap_FEATURE_CONVERGED;
    case FeatureState::kConverging:
      return perimap_FEATURE_CONVERGING;
    case FeatureState::kInconsistent:
      return perimap_FEATURE_INCONSISTENT;
    case FeatureState::kInvalid:
      return perimap_FEATURE_INVALID;
  }
  return perimap_FEATURE_INVALID;
}

perimap_FeatureReason to_wire(FeatureReason reason) noexcept {
  switch (reason) {
    case FeatureReason::kNone:
      return perimap_FEATURE_REASON_NONE;
    case FeatureReason::kNotObserved:
      return perimap_FEATURE_REASON_NOT_OBSERVED;
    case FeatureReason::kDeviationLarge:
      return perimap_FEATURE_REASON_DEVIATION_LARGE;
    case FeatureReason::kInnovationsHigh:
      return perimap_FEATURE_REASON_INNOVATIONS_HIGH;
    case FeatureReason::kPhaseLost:
      return perimap_FEATURE_REASON_PHASE_LOST;
    case FeatureReason::kShed:
      return perimap_FEATURE_REASON_SHED;
  }
  return perimap_FEATURE_REASON_PHASE_LOST;
}

perimap_PhaseState to_wire(PhaseState state) noexcept {
  switch (state) {
    case PhaseState::kLocked:
      return perimap_PHASE_LOCKED;
    case PhaseState::kFreeRunning:
      return perimap_PHASE_FREE_RUNNING;
    case PhaseState::kFromImage:
      return perimap_PHASE_FROM_IMAGE;
    case PhaseState::kLost:
      return perimap_PHASE_LOST;
    case PhaseState::kUnknown:
      return perimap_PHASE_UNKNOWN;
  }
  return perimap_PHASE_UNKNOWN;
}

perimap_Rhythm to_wire(Rhythm rhythm) noexcept {
  switch (rhythm) {
    case Rhythm::kPredictable:
      return perimap_RHYTHM_PREDICTABLE;
    case Rhythm::kUnpredictable:
      return perimap_RHYTHM_UNPREDICTABLE;
    case Rhythm::kEctopic:
      return perimap_RHYTHM_ECTOPIC;
    case Rhythm::kUnknown:
      break;
  }
  return perimap_RHYTHM_UNKNOWN;
}

perimap_EcgLead to_wire(EcgSignal signal) noexcept {
  switch (signal) {
    case EcgSignal::kLearning:
      return perimap_ECG_LEAD_LEARNING;
    case EcgSignal::kGood:
      return perimap_ECG_LEAD_GOOD;
    case EcgSignal::kNoisy:
      return perimap_ECG_LEAD_NOISY;
    case EcgSignal::kFlat:
      return perimap_ECG_LEAD_FLAT;
    case EcgSignal::kLeadOff:
      return perimap_ECG_LEAD_OFF;
    case EcgSignal::kRepeated:
      return perimap_ECG_LEAD_REPEATED;
  }
  return perimap_ECG_LEAD_OFF;
}

perimap_DisplacedCause to_wire(DisplacedCause cause) noexcept {
  switch (cause) {
    case DisplacedCause::kOrgan:
      return perimap_DISPLACED_CAUSE_ORGAN;
    case DisplacedCause::kTracker:
      return perimap_DISPLACED_CAUSE_TRACKER;
    case DisplacedCause::kUnknown:
      break;
  }
  return perimap_DISPLACED_CAUSE_UNKNOWN;
}

perimap_PhaseLaw to_wire(PhaseLaw law) noexcept {
  switch (law) {
    case PhaseLaw::kLinear:
      return perimap_PHASE_LAW_LINEAR;
    case PhaseLaw::kWarped:
      return perimap_PHASE_LAW_WARPED;
    case PhaseLaw::kTimeLocked:
      return perimap_PHASE_LAW_TIME_LOCKED;
  }
  return perimap_PHASE_LAW_LINEAR;
}

perimap_RespirationState to_wire(RespirationState state) noexcept {
  switch (state) {
    case RespirationState::kSearching:
      return perimap_RESPIRATION_SEARCHING;
    case RespirationState::kLocked:
      return perimap_RESPIRATION_LOCKED;
    case RespirationState::kOff:
      break;
  }
  return perimap_RESPIRATION_OFF;
}

perimap_RespirationSource to_wire(RespirationSource source) noexcept {
  switch (source) {
    case RespirationSource::kImage:
      return perimap_RESPIRATION_SOURCE_IMAGE;
    case RespirationSource::kChannel:
      return perimap_RESPIRATION_SOURCE_CHANNEL;
    case RespirationSource::kNone:
      break;
  }
  return perimap_RESPIRATION_SOURCE_NONE;
}

perimap_SetupState to_wire(SetupState state) noexcept {
  switch (state) {
    case SetupState::kUndetermined:
      return perimap_SETUP_UNDETERMINED;
    case SetupState::kConsistent:
      return perimap_SETUP_CONSISTENT;
    case SetupState::kDoubted:
      return perimap_SETUP_DOUBTED;
    case SetupState::kUnknown:
      break;
  }
  return perimap_SETUP_UNKNOWN;
}

}  // namespace perimap
