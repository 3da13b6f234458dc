// What the events of a procedure draw over a picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/procedure/procedure_effects.hpp"
#include "drivers/standins/simulator/lens.hpp"
#include "drivers/standins/simulator/view_drawing.hpp"

namespace perimap {

// Functions of their arguments alone.
class ProcedureView {
 public:
  // X_WV: as of organ_moves().
  ProcedureView(std::uint64_t seed, const Pose& X_WV, int width, int height) noexcept;

  struct Shot {
    Duration since;  // the session's start
    Pose X_WC;
    ScopeLens lens;
    std::size_t picture = 0;  // its number
  };
  // Adds what there is to the radiance.
  void draw(const PictureState& state, const Shot& shot, std::vector<float>& scratch, std::span<float> radiance) const;

 private:
  [[nodiscard]] ShaftPlace shaft_place(const PictureState::Shaft& shaft, const Shot& shot) const noexcept;

  std::uint64_t seed_;
  Pose X_WV_;
  int width_;
  int height_;
  ViewDrawing drawing_;
};

}  // namespace perimap
