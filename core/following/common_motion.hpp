// By what motion places that have been out of sight have come back together.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// An affine motion that a good share of the pairs agrees upon, whatever the others do, and beside it what the pairs
// nearby are off by, since tissue strains. Takes nothing from the heap once it is made.
class CommonMotion {
 public:
  // `most`: pairs; more are left out.
  explicit CommonMotion(std::size_t most);

  // A displacement, before anything is known.
  void begin_with(const Vector2d& displacement_px) noexcept;
  void clear() noexcept { pairs_.clear(); }
  void add(const Vector2d& from_px, const Vector2d& to_px) noexcept;

  // How many pairs go as one turn, scale and displacement says, to tolerance_px, of the one with most of them; what the
  // motion is then taken from. Where they are less than kFewest, it stays what it was.
  static constexpr std::size_t kFewest = 4;
  [[nodiscard]] std::size_t agree(double tolerance_px) noexcept;

  // Where it takes a place; what came from `but` itself is not asked how far it is off.
  [[nodiscard]] Vector2d at(const Vector2d& from_px, const Vector2d* but = nullptr) const noexcept;
  // Whether nearly all of the nearest pairs agree; else what is there goes another way, or several do.
  [[nodiscard]] bool holds_around(const Vector2d& from_px) const noexcept;
  // Where the pairs nearest to a place take it, whether they agree with the others or not: what is nearer to the lens
  // goes another way than what is behind it. What came from `but` itself is not asked. None where they do not agree
  // with each other to tolerance_px.
  [[nodiscard]] std::optional<Vector2d> beside(const Vector2d& from_px, double tolerance_px,
                                               const Vector2d* but = nullptr) const noexcept;
  // What it makes of a small shape.
  [[nodiscard]] const Matrix2d& shape() const noexcept { return shape_; }

 private:
  struct Pair {
    Vector2d from, to;
    bool agrees = false;
  };
  struct Similarity {
    Matrix2d shape = Matrix2d::Identity();
    Vector2d offset_px = Vector2d::Zero();
  };
  [[nodiscard]] std::size_t count(const Similarity& motion, double tolerance_px) const noexcept;
  void fit(const Similarity& motion, double tolerance_px) noexcept;
  // What the pairs nearest to a place, or those of them that agree, are off the motion by.
  template <class Nearest>
  [[nodiscard]] Nearest offs_around(const Vector2d& from_px, const Vector2d* but, bool agreeing) const noexcept;

  std::vector<Pair> pairs_;
  Matrix2d shape_ = Matrix2d::Identity();
  Vector2d from_px_ = Vector2d::Zero(), to_px_ = Vector2d::Zero();  // the middle of those that agree
};

}  // namespace perimap
