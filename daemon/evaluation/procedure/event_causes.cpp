#include "daemon/evaluation/procedure/event_causes.hpp"

#include <map>

namespace perimap {

EventCauses causes_of(std::string_view kind, bool hides) {
  const std::vector<perimap_SurfaceReason> seen{perimap_SURFACE_REASON_NOT_SEEN};
  const std::vector<perimap_SurfaceReason> no_beats{
      perimap_SURFACE_REASON_PHASE_FREE_RUNNING, perimap_SURFACE_REASON_PHASE_FROM_IMAGE,
      perimap_SURFACE_REASON_PHASE_LOST, perimap_SURFACE_REASON_PHASE_UNKNOWN};
  const std::vector<perimap_SurfaceReason> rhythm{perimap_SURFACE_REASON_ECTOPIC_BEAT,
                                                  perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE,
                                                  perimap_SURFACE_REASON_RHYTHM_ECTOPIC};
  std::vector<perimap_SurfaceReason> arcs = no_beats;
  arcs.insert(arcs.end(), seen.begin(), seen.end());
  // The organ or the tracker: the same data. NOT_SEEN says that the organ may have been moved, or that something else
  // is seen, or nothing: it names no organ that is seen well and has moved. SETUP_DOUBTED blames what was measured
  // before the session: neither the organ nor the tracker's field.
  // Where the patient's tool tells which of the two it is, the other is wrong.
  const std::vector<perimap_SurfaceReason> moved{perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED,
                                                 perimap_SURFACE_REASON_ORGAN_MOVED};
  const std::vector<perimap_SurfaceReason> erring{perimap_SURFACE_REASON_ORGAN_OR_TRACKER_MOVED,
                                                  perimap_SURFACE_REASON_TRACKER_ERRS};
  const std::map<std::string_view, EventCauses> causes = {
      {"retraction", {moved, true}},
      {"table-tilt", {moved, true}},
      {"insufflation", {moved, true}},
      {"metal", {erring, true}},
      // One place alone: its features are no longer converged, and the surface need not say anything.
      {"dent", {{}, false}},
      {"touch", {seen, false}},
      {"instrument", {seen, false}},
      {"scope-turn", {{perimap_SURFACE_REASON_SCOPE_CHANGED, perimap_SURFACE_REASON_SCOPE_UNREAD}, false}},
      {"withdrawn", {seen, true}},
      {"wiped", {seen, true}},
      {"fogged", {seen, hides}},
      {"blood", {seen, hides}},
      {"smoke", {seen, hides}},
      {"electrosurgery", {arcs, false}},
      {"tool-hidden", {{perimap_SURFACE_REASON_POSE_MISSING}, true}},
      {"ectopic-run", {rhythm, true}},
      {"leads-off", {no_beats, true}},
      {"camera-delay", {{perimap_SURFACE_REASON_SETUP_DOUBTED}, true}},
      {"tracker-delay", {{perimap_SURFACE_REASON_SETUP_DOUBTED}, true}},
  };
  const auto found = causes.find(kind);
  return found == causes.end() ? EventCauses{} : found->second;
}

bool is_of_rhythm(perimap_SurfaceReason reason) noexcept {
  return reason == perimap_SURFACE_REASON_ECTOPIC_BEAT || reason == perimap_SURFACE_REASON_RHYTHM_UNPREDICTABLE ||
         reason == perimap_SURFACE_REASON_RHYTHM_ECTOPIC || reason == perimap_SURFACE_REASON_PHASE_FREE_RUNNING;
}

}  // namespace perimap
