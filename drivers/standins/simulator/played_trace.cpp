#include "drivers/standins/simulator/played_trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kTraceStream = 0x7472616365;
constexpr double kOverlap_s = 0.5;
constexpr double kShortest = 0.6;    // of the trace, that is played
constexpr double kSpread_mm = 20.0;  // RMS distance of the points from their middle on the surface, and their reach
constexpr double kBreath_mm = 0.3;   // below that nothing breathes
constexpr std::size_t kFewestBeats = 3;

Eigen::Index overlap_of(const MotionTrace& trace) {
  return std::max<Eigen::Index>(2, static_cast<Eigen::Index>(std::lround(kOverlap_s / trace.period_s)));
}

double smooth_step(double s) { return s * s * (3.0 - 2.0 * s); }

}  // namespace

Expected<PlayedTrace> PlayedTrace::create(std::shared_ptr<const HeartTrace> trace, std::uint64_t seed) {
  PlayedTrace played(std::move(trace));
  const MotionTrace& motion = played.trace_->motion;
  const Eigen::Index count = motion.samples();
  const Eigen::Index overlap = overlap_of(motion);
  played.square_mm2_ =
      (motion.positions.rowwise() - motion.positions.colwise().mean()).squaredNorm() / static_cast<double>(count);
  const auto shortest = static_cast<Eigen::Index>(kShortest * static_cast<double>(count));
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index first = 0; first + shortest + overlap < count; ++first) {
    for (Eigen::Index last = first + shortest; last + overlap <= count; ++last) {
      const double unlike = played.unlikeness(first, last);
      if (unlike >= least) continue;
      least = unlike;
      played.first_ = first;
      played.length_ = last - first;
    }
  }
  const double length_s = static_cast<double>(played.length_) * motion.period_s;
  if (played.length_ == 0 || played.beats_s(0.0, length_s).size() < kFewestBeats) {
    return fail("motion trace: fewer than three beats are left of it where its end goes over into its beginning");
  }
  played.begins_ =
      static_cast<Eigen::Index>(CounterNoise(seed, kTraceStream).uniform(0, 0.0, static_cast<double>(played.length_)));
  return played;
}

// Of what follows two samples: motion in units of all motion, and where heart and breathing are in their cycles.
double PlayedTrace::unlikeness(Eigen::Index first, Eigen::Index last) const {
  const MotionTrace& motion = trace_->motion;
  const PhaseTracks& phases = trace_->hindsight.phases;
  const Eigen::Index overlap = overlap_of(motion);
  const double off =
      (motion.positions.middleRows(first, overlap) - motion.positions.middleRows(last, overlap)).squaredNorm();
  const double heart = std::remainder(phases.cardiac[last] - phases.cardiac[first], kTwoPi);
  const double breath = std::remainder(phases.respiratory[last] - phases.respiratory[first], kTwoPi);
  const double of_breath = trace_->hindsight.breath_mm > kBreath_mm ? breath * breath : 0.0;
  return off / (static_cast<double>(overlap) * square_mm2_) + heart * heart + of_breath;
}

Eigen::RowVectorXd PlayedTrace::at(Eigen::Index place) const {
  const MotionTrace& motion = trace_->motion;
  const Eigen::Index overlap = overlap_of(motion);
  const Eigen::Index within = ((place % length_) + length_) % length_;
  Eigen::RowVectorXd here = motion.positions.row(first_ + within);
  if (within >= overlap) return here;
  const double s = smooth_step((static_cast<double>(within) + 0.5) / static_cast<double>(overlap));
  return s * here + (1.0 - s) * motion.positions.row(first_ + length_ + within);
}

std::vector<double> PlayedTrace::beats_s(double before_s, double until_s) const {
  constexpr double kApart_s = 0.3;  // a beat that lies on the seam is found on either side of it
  const MotionTrace& motion = trace_->motion;
  const double length_s = static_cast<double>(length_) * motion.period_s;
  const double loop_s = motion.first_s + static_cast<double>(first_) * motion.period_s;
  const double begins_s = static_cast<double>(begins_) * motion.period_s;
  std::vector<double> beats;
  const auto first_turn = static_cast<int>(std::floor((begins_s - before_s) / length_s));
  for (int turn = first_turn; turn * length_s - begins_s < until_s; ++turn) {
    for (const double beat_s : trace_->hindsight.beats_s) {
      const double within_s = beat_s - loop_s;
      const double since_s = turn * length_s + within_s - begins_s;
      if (within_s < 0.0 || within_s >= length_s || since_s < -before_s || since_s > until_s) continue;
      if (beats.empty() || since_s > beats.back() + kApart_s) beats.push_back(since_s);
    }
  }
  return beats;
}

SurfaceTrace PlayedTrace::surface(const Pose& X_WV, Instant start, double before_s, double until_s) const {
  const MotionTrace& motion = trace_->motion;
  const Eigen::Index points = motion.positions.cols() / 3;
  const Eigen::RowVectorXd mean = motion.positions.middleRows(first_, length_).colwise().mean();
  Vector3d middle = Vector3d::Zero();
  for (Eigen::Index p = 0; p < points; ++p) middle += mean.segment<3>(3 * p).transpose() / static_cast<double>(points);
  double square = 0.0;
  for (Eigen::Index p = 0; p < points; ++p)
    square += (mean.segment<2>(3 * p).transpose() - middle.head<2>()).squaredNorm();
  const double spread = std::sqrt(square / static_cast<double>(points));
  const double scale = spread > 0.0 ? kSpread_mm / spread : 0.0;

  const auto before = static_cast<Eigen::Index>(std::ceil(before_s / motion.period_s));
  const auto until = static_cast<Eigen::Index>(std::ceil(until_s / motion.period_s));
  SurfaceTrace surface;
  surface.period = from_seconds(motion.period_s);
  surface.first = start - before * surface.period;
  surface.reach_mm = kSpread_mm;
  for (Eigen::Index p = 0; p < points; ++p) {
    const Vector2d off = scale * (mean.segment<2>(3 * p).transpose() - middle.head<2>());
    surface.places_W.push_back(X_WV * Vector3d(off.x(), off.y(), 0.0));
  }
  for (Eigen::Index place = -before; place <= until; ++place) {
    const Eigen::RowVectorXd moved = at(begins_ + place) - mean;
    for (Eigen::Index p = 0; p < points; ++p) {
      surface.displacements_W.emplace_back(X_WV.R * moved.segment<3>(3 * p).transpose());
    }
  }
  return surface;
}

}  // namespace perimap
