// A recorded trace of motion as it is played in a session: again and again, from wherever the seed begins, with its
// beats.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/trace/hindsight.hpp"
#include "drivers/standins/trace/motion_trace.hpp"
#include "drivers/standins/truth/surface_trace.hpp"

namespace perimap {

// What is played.
struct HeartTrace {
  MotionTrace motion;
  Hindsight hindsight;
};

class PlayedTrace {
 public:
  // The trace goes over from near its end to near its beginning where the half seconds of motion that follow, and the
  // phases of heart and breathing, are most alike; what lies before the one and behind the other is left out. Refuses a
  // trace in which fewer than three beats are left.
  [[nodiscard]] static Expected<PlayedTrace> create(std::shared_ptr<const HeartTrace> trace, std::uint64_t seed);

  // When its heart beats, s since the session's start: from `before_s` before it to `until_s`.
  [[nodiscard]] std::vector<double> beats_s(double before_s, double until_s) const;

  // How it moves a surface meanwhile. X_WV: the view that the scope rests in, its origin where it meets the organ; the
  // trace's axes are those of a camera, right, down and away. The points lie about the origin as they do in the trace,
  // but so far apart that the surface that is seen is moved by all of them.
  [[nodiscard]] SurfaceTrace surface(const Pose& X_WV, Instant start, double before_s, double until_s) const;

 private:
  explicit PlayedTrace(std::shared_ptr<const HeartTrace> trace) : trace_(std::move(trace)) {}

  [[nodiscard]] double unlikeness(Eigen::Index first, Eigen::Index last) const;
  // Sample of the trace at a place of the loop, in samples from its first.
  [[nodiscard]] Eigen::RowVectorXd at(Eigen::Index place) const;

  std::shared_ptr<const HeartTrace> trace_;
  double square_mm2_ = 0.0;  // of all motion, a sample
  Eigen::Index first_ = 0;   // sample of the loop
  Eigen::Index length_ = 0;  // of the loop, samples
  Eigen::Index begins_ = 0;  // place of the loop at the session's start
};

}  // namespace perimap
