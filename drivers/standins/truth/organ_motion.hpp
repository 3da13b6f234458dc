// How a simulated organ as a whole is moved, and dented, by what is done to it; its own beating and breathing come
// before.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// In the order in which they act on a point: what moves all of it goes from where the last move of its kind left it, to
// what is said here, and stays; a dent comes and goes within its time.
struct OrganMove {
  enum class Kind : std::uint8_t { kDent, kInsufflation, kRetraction, kTilt };
  static constexpr std::uint8_t kKinds = 4;

  Kind kind = Kind::kDent;
  Instant begin;
  Instant end;
  Vector3d translation_mm = Vector3d::Zero();  // W; of a dent, at its middle
  Vector3d rotation_rad = Vector3d::Zero();    // W, as a vector, about the pivot
  double stretch = 0.0;                        // about the pivot, a share
  Vector3d pivot_mm = Vector3d::Zero();        // W; of a dent its middle, on the organ as it is at rest
  double radius_mm = 0.0;                      // of a dent: nothing moves beyond it
};

// Where the organ is at an instant.
class OrganPlace {
 public:
  // Of a point that is at p_W by its beating and breathing, and at rest_W at rest.
  [[nodiscard]] Vector3d of(const Vector3d& p_W, const Vector3d& rest_W) const noexcept;
  // Of what is fixed to the organ as a whole, which dents do not move: where it is, that was at X_WO at rest.
  [[nodiscard]] Pose carried(const Pose& X_WO) const noexcept;

 private:
  friend class OrganMotion;
  struct Dent {
    Vector3d middle_W, displacement_W;
    double radius_mm = 0.0;
  };
  Matrix3d A_ = Matrix3d::Identity();
  Vector3d b_ = Vector3d::Zero();
  std::vector<Dent> dents_;
};

class OrganMotion {
 public:
  OrganMotion() = default;  // it stays where it is

  // In order of their beginnings. Each begins before it ends and is made of finite numbers, moves of one kind that move
  // all of it do not overlap; the error names the move.
  [[nodiscard]] static Expected<OrganMotion> create(std::vector<OrganMove> moves);

  [[nodiscard]] bool empty() const noexcept { return moves_.empty(); }
  [[nodiscard]] std::span<const OrganMove> moves() const noexcept { return moves_; }
  [[nodiscard]] OrganPlace at(Instant t) const;

 private:
  explicit OrganMotion(std::vector<OrganMove> moves) : moves_(std::move(moves)) {}

  std::vector<OrganMove> moves_;
};

}  // namespace perimap
