#include "drivers/standins/trace/hindsight.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

#include "core/angle/angle.hpp"
#include "drivers/standins/trace/two_phase_map.hpp"

namespace perimap {
namespace {

constexpr double kShortest_s = 6.0;                    // a breath and some beats
constexpr double kLateral_mm = 0.1, kDepth_mm = 0.25;  // units of the channels: what stereo tracking leaves
constexpr int kIterations = 25;
constexpr int kCautious = 10;  // of them: while the map is none, samples say little about phases
constexpr double kMoreCaution = 10.0;
// From the R peak to the fastest contraction: excitation takes some 50 ms to move the wall, and that as long to get
// going.
constexpr double kToFastest_s = 0.1;
constexpr int kParts = 360;  // of a cycle

// The points' mean over one cycle of the heart or of breathing, the other standing still.
Eigen::MatrixX3d swept(const TwoPhaseMap& map, bool heart) {
  Eigen::MatrixX3d path(kParts, 3);
  for (int i = 0; i < kParts; ++i) {
    const double phase = kTwoPi * i / kParts;
    const Eigen::RowVectorXd at = heart ? map.at(phase, 0.0) : map.at(0.0, phase);
    path.row(i).setZero();
    for (Eigen::Index p = 0; p < at.size(); p += 3)
      path.row(i) += 3.0 / static_cast<double>(at.size()) * at.segment<3>(p);
  }
  return path;
}

double fastest_phase(const Eigen::MatrixX3d& path) {
  int fastest = 0;
  double most = -1.0;
  for (int i = 0; i < kParts; ++i) {
    const double step = (path.row((i + 1) % kParts) - path.row((i + kParts - 1) % kParts)).norm();
    if (step <= most) continue;
    most = step;
    fastest = i;
  }
  return kTwoPi * fastest / kParts;
}

}  // namespace

Expected<Hindsight> in_hindsight(const MotionTrace& trace) {
  const Eigen::Index count = trace.samples();
  const double length_s = static_cast<double>(count - 1) * trace.period_s;
  if (length_s < kShortest_s) {
    return fail(fmt::format("motion trace: {:.1f} s are too short for a breath and some beats, expected {} s", length_s,
                            kShortest_s));
  }
  Eigen::VectorXd noise = Eigen::VectorXd::Constant(trace.positions.cols(), kLateral_mm);
  for (Eigen::Index depth = 2; depth < noise.size(); depth += 3) noise[depth] = kDepth_mm;
  Hindsight result;
  PhaseTracks& phases = result.phases;
  phases = steady_tracks(find_rates(trace.positions, trace.period_s, noise), trace.period_s, count);
  // All of it counts alike.
  TwoPhaseMapSettings settings;
  settings.memory_s = 10.0 * length_s;
  for (int i = 0; i < kIterations; ++i) {
    PhaseSmootherSettings smoother;
    if (i < kCautious) smoother.caution *= kMoreCaution;
    smooth_phases(smoother, TwoPhaseMap(settings, trace.positions, trace.period_s, phases), trace.positions,
                  trace.period_s, false, phases);
  }
  const TwoPhaseMap map(settings, trace.positions, trace.period_s, phases);
  const Eigen::MatrixX3d breath = swept(map, false);
  result.breath_mm = std::sqrt((breath.rowwise() - breath.colwise().mean()).rowwise().squaredNorm().mean());

  const double rate = (phases.cardiac[count - 1] - phases.cardiac[0]) / length_s;
  const double begins = fastest_phase(swept(map, true)) - kToFastest_s * rate;
  for (Eigen::Index i = 1; i < count; ++i) {
    const double before = (phases.cardiac[i - 1] - begins) / kTwoPi, now = (phases.cardiac[i] - begins) / kTwoPi;
    const double whole = std::floor(now);
    if (whole <= before) continue;
    const double share = (whole - before) / (now - before);
    result.beats_s.push_back(trace.first_s + (static_cast<double>(i - 1) + share) * trace.period_s);
  }
  return result;
}

}  // namespace perimap
