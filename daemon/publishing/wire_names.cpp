#include "daemon/publishing/wire_names.hpp"

#include <array>
#include <cstddef>

namespace perimap {
namespace {

// The values came from outside, so none is trusted as an index.
template <std::size_t N>
std::string_view name_in(const std::array<std::string_view, N>& names, int value) noexcept {
  return value >= 0 && static_cast<std::size_t>(value) < N ? names[static_cast<std::size_t>(value)] : "unknown";
}

}  // namespace

std::string_view name_of(perimap_SurfaceState state) noexcept {
  return name_in<3>({"invalid", "degraded", "good"}, static_cast<int>(state));
}

std::string_view name_of(perimap_SurfaceReason reason) noexcept {
  return name_in<27>({"none",
                      "nothing_mapped",
                      "phase_unknown",
                      "phase_free_running",
                      "phase_lost",
                      "frame_missing",
                      "update_late",
                      "pose_missing",
                      "phase_contradicted",
                      "respiration_unknown",
                      "phase_from_image",
                      "ectopic_beat",
                      "rhythm_unpredictable",
                      "rhythm_ectopic",
                      "law_undecided",
                      "not_seen",
                      "no_parallax",
                      "setup_doubted",
                      "nothing_converged",
                      "scope_unread",
                      "scope_changed",
                      "pose_repeated",
                      "picture_repeated",
                      "organ_or_tracker_moved",
                      "organ_moved",
                      "tracker_errs",
                      "setup_uncertain"},
                     static_cast<int>(reason));
}

std::string_view name_of(perimap_FeatureState state) noexcept {
  return name_in<4>({"invalid", "converging", "converged", "inconsistent"}, static_cast<int>(state));
}

std::string_view name_of(perimap_FeatureReason reason) noexcept {
  return name_in<6>({"none", "not_observed", "deviation_large", "innovations_high", "phase_lost", "shed"},
                    static_cast<int>(reason));
}

std::string_view name_of(perimap_StageKind kind) noexcept {
  return name_in<8>({"predict_and_find", "phase_and_pose", "evaluate", "learn", "capture_to_update",
                     "release_tardiness", "dds_write", "frame"},
                    static_cast<int>(kind));
}

std::string_view name_of(perimap_PhaseState state) noexcept {
  return name_in<5>({"unknown", "locked", "free_running", "lost", "from_image"}, static_cast<int>(state));
}

std::string_view name_of(perimap_Rhythm rhythm) noexcept {
  return name_in<4>({"unknown", "predictable", "unpredictable", "ectopic"}, static_cast<int>(rhythm));
}

std::string_view name_of(perimap_RespirationState state) noexcept {
  return name_in<3>({"off", "searching", "locked"}, static_cast<int>(state));
}

std::string_view name_of(perimap_RespirationSource source) noexcept {
  return name_in<3>({"none", "image", "channel"}, static_cast<int>(source));
}

std::string_view name_of(perimap_Privilege privilege) noexcept {
  return name_in<3>({"not_requested", "granted", "refused"}, static_cast<int>(privilege));
}

std::string_view name_of(perimap_RecordingState state) noexcept {
  return name_in<3>({"off", "on", "stopped"}, static_cast<int>(state));
}

std::string_view name_of(perimap_ScopeTurn turn) noexcept {
  return name_in<3>({"unread", "read", "changed"}, static_cast<int>(turn));
}

std::string_view name_of(perimap_EcgLead lead) noexcept {
  return name_in<7>({"none", "learning", "good", "noisy", "flat", "off", "repeated"}, static_cast<int>(lead));
}

std::string_view name_of(perimap_DisplacedCause cause) noexcept {
  return name_in<3>({"unknown", "organ", "tracker"}, static_cast<int>(cause));
}

std::string_view name_of(perimap_SourceKind kind) noexcept {
  return name_in<5>({"camera", "tracker", "ecg", "r_trigger", "respiration"}, static_cast<int>(kind));
}

std::string_view name_of(perimap_SourceState state) noexcept {
  return name_in<5>({"starting", "ok", "stalled", "ended", "closed"}, static_cast<int>(state));
}

std::string_view name_of(perimap_SetupState state) noexcept {
  return name_in<4>({"unknown", "undetermined", "consistent", "doubted"}, static_cast<int>(state));
}

}  // namespace perimap
