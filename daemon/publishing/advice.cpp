#include "daemon/publishing/advice.hpp"

namespace perimap {

std::string_view permission_of(perimap_SurfaceState state) noexcept {
  switch (state) {
    case perimap_SURFACE_GOOD:
      return "may be used";
    case perimap_SURFACE_DEGRADED:
      return "use with care";
    case perimap_SURFACE_INVALID:
      break;
  }
  return "use no position";
}

std::string_view remedy_of(perimap_SurfaceReason reason) noexcept {
  switch (reason) {
    case perimap_SURFACE_REASON_NONE:
      return "";
    case perimap_SURFACE_REASON_NOTHING_MAPPED:
    case perimap_SURFACE_REASON_NOTHING_CONVERGED:
      return "move the scope slowly around the surface, and wait for some heart beats";
    case perimap_SURFACE_REASON_PHASE_UNKNOWN:
      return "wait for some heart beats; if none come, look at the ECG's electrodes";
    case perimap_SURFACE_REASON_PHASE_FREE_RUNNING:
    case perimap_SURFACE_REASON_PHASE_LOST:
    case perimap_SURFACE_REASON_PHASE_FROM_IMAGE:
      return "look at the ECG: electrodes, cable, amplifier";
    case perimap_SURFACE_REASON_FRAME_MISSING:
      return "look at the camera: cable, scope processor, capture card";
    case perimap_SURFACE_REASON_UPDATE_LATE:
      return "the computer is too slow: end other programs, or raise pipeline.latency_ms";
    case perimap_SURFACE_REASON_POSE_MISSING:
      return "look at the tracker: cable, line of sight, the sensor within its volume";
    case perimap_SURFACE_REASON_PHASE_CONTRADICTED:
      return "wait; if it lasts, look at the ECG";
    case perimap_SURFACE_REASON_RESPIRATION_UNKNOWN:
      return "wait for some breaths; if it lasts, set respiration.enabled";
    case perimap_SURFACE_REASON_ECTOPIC_BEAT:
      return "wait for the next beat";
    case perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE:
    case perimap_SURFACE_REASON_RHYTHM_ECTOPIC:
      return "wait for a regular rhythm";
    case perimap_SURFACE_REASON_LAW_UNDECIDED:
      return "wait for some heart beats of other lengths";
    case perimap_SURFACE_REASON_NOT_SEEN:
      return "turn the scope back to the mapped place, and wait a second; if that does not help: perimap ctl "
             "new-patient";
    case perimap_SURFACE_REASON_NO_PARALLAX:
      return "move the scope sideways";
    case perimap_SURFACE_REASON_SETUP_DOUBTED:
      return "check the set-up: perimap verify";
    case perimap_SURFACE_REASON_SETUP_UNCERTAIN:
      return "hand-eye, lens and time offset are not checked yet: move the scope sideways by some centimetres, and "
             "wait "
             "for some heart beats; if that does not help: perimap verify";
    case perimap_SURFACE_REASON_SCOPE_UNREAD:
      return "the notch of the field stop must be seen, or the second sensor";
    case perimap_SURFACE_REASON_SCOPE_CHANGED:
      return "turn the scope back, or measure its turns: perimap calibrate scope";
    case perimap_SURFACE_REASON_POSE_REPEATED:
      return "restart the tracker, or look at its cable";
    case perimap_SURFACE_REASON_PICTURE_REPEATED:
      return "look at the camera: the picture stands still";
    case perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED:
      return "let the organ go back, or see what disturbs the tracker; if the organ was moved: perimap ctl organ-moved";
    case perimap_SURFACE_REASON_ORGAN_MOVED:
      return "let the organ come to rest and look at it: the map is moved with it";
    case perimap_SURFACE_REASON_TRACKER_ERRS:
      return "see what disturbs the tracker: metal, a sensor that has slipped, its line of sight";
  }
  return "update perimap view: perimapd is newer";
}

}  // namespace perimap
