#include "drivers/standins/truth/truth_messages.hpp"

#include <cmath>
#include <string>
#include <utility>

namespace perimap {

perimap_TruthMesh borrow_truth_mesh(const HeartMesh& mesh_W) {
  perimap_TruthMesh message{};
  message.vertex_count = mesh_W.vertex_count;
  message.harmonics = mesh_W.harmonics;
  // The C types have no const; nothing that serialises them writes.
  message.coefficients_W_mm._buffer = const_cast<double*>(mesh_W.coefficients_mm.data());
  message.coefficients_W_mm._length = static_cast<std::uint32_t>(mesh_W.coefficients_mm.size());
  message.coefficients_W_mm._maximum = message.coefficients_W_mm._length;
  message.triangles._buffer = const_cast<std::uint32_t*>(mesh_W.triangles.data());
  message.triangles._length = static_cast<std::uint32_t>(mesh_W.triangles.size());
  message.triangles._maximum = message.triangles._length;
  return message;
}

perimap_TruthMotion borrow_truth_motion(const HeartMotion& motion, std::vector<std::int64_t>& r_peaks_ns) {
  r_peaks_ns.clear();
  for (const Instant r_peak : motion.r_peaks) r_peaks_ns.push_back(to_ns(r_peak));
  perimap_TruthMotion message{};
  switch (motion.law) {
    case MotionLaw::kLinear:
      message.law = perimap_PHASE_LAW_LINEAR;
      break;
    case MotionLaw::kWarped:
      message.law = perimap_PHASE_LAW_WARPED;
      break;
    case MotionLaw::kTimeLocked:
      message.law = perimap_PHASE_LAW_TIME_LOCKED;
      break;
  }
  message.r_peak_time_ns._buffer = r_peaks_ns.data();
  message.r_peak_time_ns._length = static_cast<std::uint32_t>(r_peaks_ns.size());
  message.r_peak_time_ns._maximum = message.r_peak_time_ns._length;
  message.systole_fraction = motion.systole_fraction;
  message.systole_offset_s = motion.systole_offset_s;
  message.systole_slope_s_per_bpm = motion.systole_slope_s_per_bpm;
  message.locked_systole_ns = motion.locked_systole.count();
  message.locked_filling_ns = motion.locked_filling.count();
  message.locked_systole_phase_rad = motion.locked_systole_phase_rad;
  message.locked_filling_phase_rad = motion.locked_filling_phase_rad;
  for (int axis = 0; axis < 3; ++axis) message.respiration_W_mm[axis] = motion.respiration_mm[axis];
  message.respiration_period_ns = motion.respiration_period.count();
  return message;
}

perimap_TruthCamera to_truth_camera(const CameraTruth& camera) noexcept {
  perimap_TruthCamera message{};
  message.capture_time_ns = to_ns(camera.capture);
  for (int axis = 0; axis < 3; ++axis) message.translation_WC_mm[axis] = camera.X_WC.t[axis];
  rotation_to_wxyz(camera.X_WC.R, message.rotation_WC_wxyz);
  for (int axis = 0; axis < 2; ++axis) message.focal_px[axis] = camera.focal_px[axis];
  for (int axis = 0; axis < 2; ++axis) message.principal_point_px[axis] = camera.principal_px[axis];
  message.scope_rotation_rad = camera.scope_rotation_rad;
  return message;
}

perimap_TruthProcedure borrow_truth_procedure(const GroundTruth& truth, ProcedureBuffers& buffers) {
  buffers = {};
  for (const OrganMove& move : truth.organ().moves()) {
    perimap_TruthOrganMove message{};
    message.kind = static_cast<std::uint8_t>(move.kind);
    message.begin_time_ns = to_ns(move.begin);
    message.end_time_ns = to_ns(move.end);
    message.stretch = move.stretch;
    message.radius_mm = move.radius_mm;
    for (int axis = 0; axis < 3; ++axis) {
      message.translation_W_mm[axis] = move.translation_mm[axis];
      message.rotation_W_rad[axis] = move.rotation_rad[axis];
      message.pivot_W_mm[axis] = move.pivot_mm[axis];
    }
    buffers.moves.push_back(message);
  }
  for (const Drift& drift : truth.camera_delays()) {
    buffers.delays.push_back({to_ns(drift.begin), to_ns(drift.end), drift.to.count()});
  }
  perimap_TruthProcedure message{};
  message.organ_moves._buffer = buffers.moves.data();
  message.organ_moves._length = message.organ_moves._maximum = static_cast<std::uint32_t>(buffers.moves.size());
  message.camera_delays._buffer = buffers.delays.data();
  message.camera_delays._length = message.camera_delays._maximum = static_cast<std::uint32_t>(buffers.delays.size());
  return message;
}

Expected<void> set_procedure(const perimap_TruthProcedure& message, GroundTruth& truth) {
  std::vector<OrganMove> moves;
  for (std::uint32_t i = 0; i < message.organ_moves._length; ++i) {
    const perimap_TruthOrganMove& recorded = message.organ_moves._buffer[i];
    if (recorded.kind >= OrganMove::kKinds) return fail("organ motion: move " + std::to_string(i) + " is of no kind");
    moves.push_back({static_cast<OrganMove::Kind>(recorded.kind), from_ns(recorded.begin_time_ns),
                     from_ns(recorded.end_time_ns), Vector3d(recorded.translation_W_mm),
                     Vector3d(recorded.rotation_W_rad), recorded.stretch, Vector3d(recorded.pivot_W_mm),
                     recorded.radius_mm});
  }
  auto organ = OrganMotion::create(std::move(moves));
  if (!organ) return tl::unexpected(organ.error());
  std::vector<Drift> delays;
  for (std::uint32_t i = 0; i < message.camera_delays._length; ++i) {
    const perimap_TruthDelay& recorded = message.camera_delays._buffer[i];
    const Drift drift{from_ns(recorded.begin_time_ns), from_ns(recorded.end_time_ns), Duration(recorded.to_ns)};
    const bool in_order = drift.end > drift.begin && (delays.empty() || drift.begin >= delays.back().end);
    if (!in_order || std::abs(to_seconds(drift.to)) > 1.0) {
      return fail("camera delay " + std::to_string(i) + ": it is not in order, or more than a second");
    }
    delays.push_back(drift);
  }
  truth.set_procedure(std::move(*organ), std::move(delays));
  return {};
}

perimap_TruthTrace borrow_truth_trace(const SurfaceTrace& trace, TraceBuffers& buffers) {
  buffers = {};
  for (const Vector3d& p : trace.places_W) buffers.places.insert(buffers.places.end(), p.begin(), p.end());
  for (const Vector3d& p : trace.displacements_W) {
    buffers.displacements.insert(buffers.displacements.end(), p.begin(), p.end());
  }
  perimap_TruthTrace message{};
  message.first_time_ns = to_ns(trace.first);
  message.period_ns = trace.period.count();
  message.reach_mm = trace.reach_mm;
  const auto lend = [](auto& sequence, std::vector<double>& numbers) {
    sequence._buffer = numbers.data();
    sequence._length = sequence._maximum = static_cast<std::uint32_t>(numbers.size());
  };
  lend(message.place_W_mm, buffers.places);
  lend(message.displacement_W_mm, buffers.displacements);
  return message;
}

Expected<SurfaceTrace> surface_trace(const perimap_TruthTrace& message) {
  SurfaceTrace trace{from_ns(message.first_time_ns), Duration(message.period_ns), message.reach_mm, {}, {}};
  if (message.place_W_mm._length == 0 || message.displacement_W_mm._length == 0 ||
      message.place_W_mm._length % 3 != 0 || message.displacement_W_mm._length % 3 != 0) {
    return fail("motion trace: expected x, y, z of each point");
  }
  const auto threes = [](const auto& sequence, std::vector<Vector3d>& points) {
    for (std::uint32_t i = 0; i < sequence._length; i += 3) points.emplace_back(sequence._buffer + i);
  };
  threes(message.place_W_mm, trace.places_W);
  threes(message.displacement_W_mm, trace.displacements_W);
  return trace;
}

Expected<HeartMesh> heart_mesh(const perimap_TruthMesh& message) {
  HeartMesh mesh;
  mesh.vertex_count = message.vertex_count;
  mesh.harmonics = message.harmonics;
  const auto& coefficients = message.coefficients_W_mm;
  mesh.coefficients_mm.assign(coefficients._buffer, coefficients._buffer + coefficients._length);
  mesh.triangles.assign(message.triangles._buffer, message.triangles._buffer + message.triangles._length);
  if (const auto good = check(mesh); !good) return tl::unexpected(good.error());
  return mesh;
}

Expected<HeartMotion> heart_motion(const perimap_TruthMotion& message) {
  HeartMotion motion;
  switch (message.law) {
    case perimap_PHASE_LAW_LINEAR:
      motion.law = MotionLaw::kLinear;
      break;
    case perimap_PHASE_LAW_WARPED:
      motion.law = MotionLaw::kWarped;
      break;
    case perimap_PHASE_LAW_TIME_LOCKED:
      motion.law = MotionLaw::kTimeLocked;
      break;
    default:
      return fail("heart motion: there is no phase law " + std::to_string(static_cast<int>(message.law)));
  }
  for (std::uint32_t i = 0; i < message.r_peak_time_ns._length; ++i)
    motion.r_peaks.push_back(from_ns(message.r_peak_time_ns._buffer[i]));
  motion.systole_fraction = message.systole_fraction;
  motion.systole_offset_s = message.systole_offset_s;
  motion.systole_slope_s_per_bpm = message.systole_slope_s_per_bpm;
  motion.locked_systole = Duration(message.locked_systole_ns);
  motion.locked_filling = Duration(message.locked_filling_ns);
  motion.locked_systole_phase_rad = message.locked_systole_phase_rad;
  motion.locked_filling_phase_rad = message.locked_filling_phase_rad;
  motion.respiration_mm = Vector3d(message.respiration_W_mm);
  motion.respiration_period = Duration(message.respiration_period_ns);
  if (const auto good = check(motion); !good) return tl::unexpected(good.error());
  return motion;
}

Expected<CameraTruth> camera_truth(const perimap_TruthCamera& message) {
  const Vector3d t(message.translation_WC_mm);
  const double norm = Eigen::Vector4d(message.rotation_WC_wxyz).norm();
  if (!t.allFinite() || !(std::abs(norm - 1.0) < 1e-6))
    return fail("camera truth at " + std::to_string(message.capture_time_ns) + " ns: its pose is not a rigid one");
  const Vector2d focal(message.focal_px), principal(message.principal_point_px);
  if (!focal.allFinite() || !principal.allFinite() || focal.minCoeff() < 0.0)
    return fail("camera truth at " + std::to_string(message.capture_time_ns) + " ns: its lens is none");
  return CameraTruth{from_ns(message.capture_time_ns), pose_from_wxyz(t, message.rotation_WC_wxyz), focal, principal,
                     message.scope_rotation_rad};
}

}  // namespace perimap
