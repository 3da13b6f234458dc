// Whether a place of the surface has features about it, or is a guess: in a hole, or beyond the edge.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

enum class Support : std::uint8_t {
  kSupported,
  kTooFar,       // from every feature: a hole, or what nobody has looked at
  kBeyondEdge,   // all features about it lie on one side of it, and none is near
  kUncertain,    // its deviation is above the bound
  kOutsideChart  // behind the mean camera
};

// How far from features a place may be goes by how far they are from each other.
class EvidenceSupport {
 public:
  // Places in the chart (mm), at least two.
  explicit EvidenceSupport(std::vector<Vector2d> places);

  [[nodiscard]] Support at(const Vector2d& s) const;
  // How far from the nearest feature a place is that has all features on one side of it; 0 where it has not, or one is
  // near. How the surface goes on there is a guess.
  [[nodiscard]] double beyond_mm(const Vector2d& s) const;

  [[nodiscard]] double reach_mm() const noexcept { return reach_mm_; }
  // Beyond the last features: so far at most, and so far in any case.
  [[nodiscard]] double margin_mm() const noexcept { return margin_mm_; }
  [[nodiscard]] double edge_mm() const noexcept { return edge_mm_; }
  [[nodiscard]] std::span<const Vector2d> places() const noexcept { return places_; }

 private:
  [[nodiscard]] double nearest_mm(const Vector2d& s) const;
  [[nodiscard]] bool is_beyond(const Vector2d& s) const;

  std::vector<Vector2d> places_;
  double reach_mm_ = 0.0;
  double margin_mm_ = 0.0;
  double edge_mm_ = 0.0;
};

}  // namespace perimap
