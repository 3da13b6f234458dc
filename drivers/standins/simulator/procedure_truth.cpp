#include "drivers/standins/simulator/procedure_truth.hpp"

#include <optional>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// Of what moves the organ; none of all else.
std::optional<OrganMove> move_of(const Happening& what, const Pose& X_WV) {
  OrganMove move;
  move.pivot_mm = X_WV.t;
  const Dent* dent = std::get_if<Dent>(&what);
  if (const auto* touch = std::get_if<Touch>(&what)) dent = touch;
  if (dent != nullptr) {
    move.kind = OrganMove::Kind::kDent;
    move.pivot_mm = X_WV * Vector3d(dent->place_mm.x(), dent->place_mm.y(), 0.0);
    move.translation_mm = X_WV.R * Vector3d(0.0, 0.0, dent->depth_mm);
    move.radius_mm = dent->radius_mm;
    return move;
  }
  if (const auto* retraction = std::get_if<Retraction>(&what)) {
    move.kind = OrganMove::Kind::kRetraction;
    move.translation_mm = X_WV.R * retraction->shift_mm;
    move.rotation_rad = X_WV.R * Vector3d(0.0, 0.0, retraction->turn_deg * kDegree);
    return move;
  }
  if (const auto* gas = std::get_if<Insufflation>(&what)) {
    move.kind = OrganMove::Kind::kInsufflation;
    move.translation_mm = X_WV.R * Vector3d(0.0, 0.0, -gas->rise_mm);
    move.stretch = 1e-2 * gas->stretch_percent;
    return move;
  }
  if (const auto* tilt = std::get_if<TableTilt>(&what)) {
    constexpr double kAxis_mm = 150.0;  // behind the surface
    move.kind = OrganMove::Kind::kTilt;
    move.pivot_mm = X_WV * Vector3d(0.0, 0.0, kAxis_mm);
    // The surface lies on the near side of the axis: turned by a negative angle about "down" it goes to the right, and
    // by a positive one about "right" it goes down.
    move.rotation_rad = X_WV.R * Vector3d(tilt->head_deg * kDegree, -tilt->side_deg * kDegree, 0.0);
    return move;
  }
  return std::nullopt;
}

template <class Kind>
std::vector<Drift> delays_of(const Procedure& procedure, Instant start) {
  std::vector<Drift> drifts;
  for (const ProcedureEvent& event : procedure.events) {
    if (const auto* delay = std::get_if<Kind>(&event.what)) {
      drifts.push_back({start + event.at, start + event.end(), from_seconds(1e-3 * delay->to_ms)});
    }
  }
  return drifts;
}

}  // namespace

std::vector<OrganMove> organ_moves(const Procedure& procedure, Instant start, const Pose& X_WV) {
  std::vector<OrganMove> moves;
  for (const ProcedureEvent& event : procedure.events) {
    auto move = move_of(event.what, X_WV);
    if (!move) continue;
    move->begin = start + event.at;
    move->end = start + event.end();
    moves.push_back(*move);
  }
  return moves;
}

std::vector<Drift> camera_delays(const Procedure& procedure, Instant start) {
  return delays_of<CameraDelay>(procedure, start);
}

std::vector<Drift> tracker_delays(const Procedure& procedure, Instant start) {
  return delays_of<TrackerDelay>(procedure, start);
}

}  // namespace perimap
