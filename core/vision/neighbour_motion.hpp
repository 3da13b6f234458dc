// How the tissue about a place has moved since the frame before, going by the features around it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// The features that were found in two frames running, by where they came from.
class NeighbourMotion {
 public:
  static constexpr std::size_t kNeighbours = 6;
  static constexpr std::size_t kFewest = 4;

  struct Around {
    bool known = false;              // there were enough of them
    Vector2d by = Vector2d::Zero();  // their middle displacement along each axis, px
    double distance_px = 0;          // of those it is taken from, in the mean
    double disagreement_px = 0;      // how far the middle one of them is off `by`
  };

  explicit NeighbourMotion(std::size_t most_features) { displacements_.reserve(most_features); }

  void clear() noexcept { displacements_.clear(); }
  // At most as many as were announced; more are left out.
  void add(const Vector2d& from_px, const Vector2d& to_px) noexcept;

  // Of the nearest to a place in the frame before. What came from `but` itself is not asked.
  [[nodiscard]] Around around(const Vector2d& px, const Vector2d* but) const noexcept;

 private:
  struct Displacement {
    Vector2d from;
    Vector2d by;
  };
  std::vector<Displacement> displacements_;
};

}  // namespace perimap
