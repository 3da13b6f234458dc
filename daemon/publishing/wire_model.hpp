// The surface model and the phase as wire types. Not for the real-time path: they allocate.
#pragma once

#include <perimap.h>

#include <vector>

#include "core/time/instant.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

class CardiacClock;
struct ModelMoment;

// Owns the buffers that its message points to.
class WireModel {
 public:
  explicit WireModel(const Identity& identity);

  // Valid until the next call.
  [[nodiscard]] const perimap_SurfaceModel& fill(const ModelMoment& moment);

 private:
  void fill_features(const ModelMoment& moment);
  void fill_cycles(const ModelMoment& moment);

  std::vector<perimap_ModelFeature> features_;
  std::vector<std::vector<double>> coefficients_;
  std::vector<perimap_CardiacCycle> cycles_;
  perimap_SurfaceModel wire_{};
};

class WirePhase {
 public:
  explicit WirePhase(const Identity& identity);
  [[nodiscard]] const perimap_Phase& fill(const CardiacClock& clock, Instant now) noexcept;

 private:
  perimap_Phase wire_{};
};

}  // namespace perimap
