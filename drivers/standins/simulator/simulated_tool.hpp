// A tracked probe beside the simulated scope: it comes to the beating heart, touches it, stays on it and leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

// Where its tip really is, at one instant.
struct ToolTruth {
  Instant time;
  Vector3d tip_W_mm = Vector3d::Zero();
  double distance_mm = 0.0;  // from the true surface: positive outside
  bool touches = false;
};

// From four seconds on it touches a place that the scope looks at, for one to two seconds, again and again. It comes
// and goes at 15 to 40 mm/s along a line that is up to 35 degrees off the scope's own; near the surface the hand
// follows what it is about to touch, and on it the tip goes with the material. It is not in the picture: what it hides
// there is `ViewObstacles`' to show. A function of the simulation alone.
class SimulatedTool {
 public:
  static inline const std::string kName = "probe";

  explicit SimulatedTool(const Simulation& simulation);

  // At the times of the simulation's tracker_sample(index), with errors of its own; it is always seen.
  [[nodiscard]] TrackerSample sample(std::size_t index, const TrackerNoise& noise) const noexcept;
  [[nodiscard]] const ToolTruth& truth(std::size_t index) const noexcept { return truths_[index]; }

  // Tip in the tool's frame O, mm, and as `perimap calibrate tool --output` writes it, exact.
  [[nodiscard]] static Vector3d tip_O_mm() noexcept { return {3.0, -2.0, -118.0}; }
  [[nodiscard]] static std::string calibration();

 private:
  // One touch: from the begin of the way to the surface until the tip is away again.
  struct Touch {
    double begin_s = 0.0, hold_s = 0.0, speed_mm_per_s = 0.0;
    SurfacePoint point;
    Vector3d axis_W = Vector3d::UnitZ();  // unit, from the tip along the shaft

    [[nodiscard]] double way_s() const noexcept { return kAway_mm / speed_mm_per_s; }
    [[nodiscard]] double end_s() const noexcept { return begin_s + 2.0 * way_s() + hold_s; }
    [[nodiscard]] double height_mm(double t_s) const noexcept;
  };
  struct Tip {
    Vector3d p_W_mm = Vector3d::Zero();
    Vector3d axis_W = Vector3d::UnitZ();
    bool touches = false;
  };
  static constexpr double kAway_mm = 25.0;

  void plan(const Simulation& simulation);
  [[nodiscard]] Tip tip_of(const Touch& touch, double t_s, const GroundTruth& truth, Instant start) const;
  [[nodiscard]] Tip tip_at(double t_s, const GroundTruth& truth, Instant start) const;

  std::vector<Touch> touches_;
  std::vector<ToolTruth> truths_;
  std::vector<TrackerSample> samples_;  // exact
  std::vector<Vector3d> position_errors_, rotation_errors_;
};

}  // namespace perimap
