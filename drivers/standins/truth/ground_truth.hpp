// Where any point of a simulated heart really is: the same surface and motion from which the images are rendered.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/truth/drift.hpp"
#include "drivers/standins/truth/heart_mesh.hpp"
#include "drivers/standins/truth/heart_motion.hpp"
#include "drivers/standins/truth/organ_motion.hpp"
#include "drivers/standins/truth/surface_trace.hpp"
#include "drivers/standins/truth/surface_view.hpp"

namespace perimap {

struct CameraTruth {
  Instant capture;
  Pose X_WC;
  // As the scope was turned and zoomed; a focal length of 0: as the calibration has it.
  Vector2d focal_px = Vector2d::Zero();
  Vector2d principal_px = Vector2d::Zero();
  double scope_rotation_rad = 0.0;
};

class GroundTruth {
 public:
  // The mesh's coordinates are world coordinates (W). `cameras` may be empty; it is sorted by capture time here.
  // The error names what is wrong with the mesh or the motion.
  [[nodiscard]] static Expected<GroundTruth> create(HeartMesh mesh_W, HeartMotion motion,
                                                    std::vector<CameraTruth> cameras = {});

  // What is done to the organ, and to the camera's delay; nothing at first.
  void set_procedure(OrganMotion organ, std::vector<Drift> camera_delays);

  // What moves the surface beside its own beating and breathing; nothing at first. The error names what is wrong with
  // it.
  [[nodiscard]] Expected<void> set_trace(SurfaceTrace trace);

  [[nodiscard]] const HeartMesh& mesh() const noexcept { return mesh_; }
  [[nodiscard]] const HeartMotion& motion() const noexcept { return motion_; }
  [[nodiscard]] MotionPhase phase(Instant t) const noexcept { return motion_phase(motion_, t); }

  // True pose of the camera in the frame captured at exactly this instant.
  [[nodiscard]] std::optional<Pose> camera_pose(Instant capture) const noexcept;
  [[nodiscard]] const OrganMotion& organ() const noexcept { return organ_; }
  [[nodiscard]] const SurfaceTrace& trace() const noexcept { return trace_; }
  [[nodiscard]] const std::vector<Drift>& camera_delays() const noexcept { return camera_delays_; }
  // When the picture was really taken that is stamped so: of that instant is what it shows, and its camera's pose.
  [[nodiscard]] Instant taken_at(Instant capture) const noexcept { return capture - drifted(camera_delays_, capture); }

  // All that is true of it; null where there was no frame.
  [[nodiscard]] const CameraTruth* camera(Instant capture) const noexcept;

  // Positions of all vertices at t, W, mm; `out` has mesh().vertex_count places.
  void vertices_at(Instant t, std::span<Vector3d> out) const;

  // The surface as a camera at X_WC has it before it at t.
  [[nodiscard]] SurfaceView view(const Pose& X_WC, Instant t) const;

  // view(X_WC, t).first_hit(ray_C), for a single ray.
  [[nodiscard]] std::optional<SurfacePoint> first_hit(const Pose& X_WC, const Vector3d& ray_C, Instant t) const;

  // Position of a material point at t, W, mm.
  [[nodiscard]] Vector3d position(const SurfacePoint& point, Instant t) const;

 private:
  GroundTruth(HeartMesh mesh_W, HeartMotion motion, std::vector<CameraTruth> cameras) noexcept
      : mesh_(std::move(mesh_W)), motion_(std::move(motion)), cameras_(std::move(cameras)) {}

  // Of a vertex without its beating.
  [[nodiscard]] Vector3d rest(std::uint32_t vertex) const noexcept;

  HeartMesh mesh_;
  HeartMotion motion_;
  std::vector<CameraTruth> cameras_;
  SurfaceTrace trace_;
  OrganMotion organ_;
  std::vector<Drift> camera_delays_;
};

}  // namespace perimap
