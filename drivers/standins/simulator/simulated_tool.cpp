#include "drivers/standins/simulator/simulated_tool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "core/geometry/nearest_shares.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/slow_error.hpp"

namespace perimap {
namespace {

// Streams of the seed that no other part of the simulation has.
constexpr std::uint64_t kToolPath = 7001, kToolPosition = 7002, kToolRotation = 7003;
// Within so much of the surface the hand follows it.
constexpr double kFollows_mm = 12.0;
constexpr double kFirst_s = 4.0;
constexpr double kBetween_s = 0.8;  // from one place to the next

double smooth(double x) noexcept {
  const double s = std::clamp(x, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

// Signed by the side of the nearest triangle; where several are as near, of the one that faces the point most.
double distance_from(const std::vector<Vector3d>& vertices, const std::vector<std::uint32_t>& triangles,
                     const Vector3d& p) {
  constexpr double kSame_mm = 1e-9;
  double least = std::numeric_limits<double>::infinity(), facing = 0.0;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const Vector3d &a = vertices[triangles[t]], &b = vertices[triangles[t + 1]], &c = vertices[triangles[t + 2]];
    const Vector3d s = nearest_shares(p, a, b, c);
    const Vector3d to = p - (s[0] * a + s[1] * b + s[2] * c);
    const double distance = to.norm();
    if (distance > least + kSame_mm) continue;
    const double side = to.dot((b - a).cross(c - a).normalized());
    if (distance < least - kSame_mm || std::abs(side) > std::abs(facing)) facing = side;
    least = std::min(least, distance);
  }
  return facing < 0.0 ? -least : least;
}

Matrix3d frame_with_z(const Vector3d& z) {
  const Vector3d aside = std::abs(z.x()) < 0.8 ? Vector3d::UnitX() : Vector3d::UnitY();
  Matrix3d R;
  R.col(2) = z;
  R.col(0) = aside.cross(z).normalized();
  R.col(1) = z.cross(R.col(0));
  return R;
}

}  // namespace

double SimulatedTool::Touch::height_mm(double t_s) const noexcept {
  const double coming = kAway_mm - speed_mm_per_s * (t_s - begin_s);
  const double going = speed_mm_per_s * (t_s - (begin_s + way_s() + hold_s));
  return std::clamp(std::max(coming, going), 0.0, kAway_mm);
}

SimulatedTool::SimulatedTool(const Simulation& simulation) {
  plan(simulation);
  const GroundTruth& truth = simulation.truth();
  const CounterNoise position(simulation.settings().seed, kToolPosition);
  const CounterNoise rotation(simulation.settings().seed, kToolRotation);
  SlowError position_error(simulation.settings().tracker_rate_hz, simulation.settings().tracker_correlation);
  SlowError rotation_error = position_error;
  std::vector<Vector3d> vertices(truth.mesh().vertex_count);
  for (std::size_t k = 0; k < simulation.tracker_sample_count(); ++k) {
    TrackerSample sample = simulation.tracker_sample(k, {});
    const Instant t = sample.source_time + simulation.setup().tracker_offset;
    const Tip tip = tip_at(to_seconds(t - simulation.start()), truth, simulation.start());
    truth.vertices_at(t, vertices);
    const double distance = tip.touches ? 0.0 : distance_from(vertices, truth.mesh().triangles, tip.p_W_mm);
    truths_.push_back({t, tip.p_W_mm, distance, tip.touches});
    sample.state = ToolState::kOk;
    sample.X_WS.R = frame_with_z(tip.axis_W);
    sample.X_WS.t = tip.p_W_mm - sample.X_WS.R * tip_O_mm();
    samples_.push_back(sample);
    position_errors_.push_back(position_error.next(normal3(position, k)));
    rotation_errors_.push_back(rotation_error.next(normal3(rotation, k)));
  }
}

// Places are drawn on the surface that the scope sees at the start.
void SimulatedTool::plan(const Simulation& simulation) {
  const CounterNoise draw(simulation.settings().seed, kToolPath);
  const Pose& X_WC = simulation.frames().front().X_WC;
  const SurfaceView view = simulation.truth().view(X_WC, simulation.start());
  const double end_s = to_seconds(simulation.settings().duration);
  double begin_s = kFirst_s;
  for (std::uint64_t n = 0; begin_s < end_s; ++n) {
    const auto drawn = [&](std::uint64_t i, double low, double high) { return draw.uniform(16 * n + i, low, high); };
    Touch touch;
    touch.begin_s = begin_s;
    touch.hold_s = drawn(0, 1.0, 2.0);
    touch.speed_mm_per_s = drawn(1, 15.0, 40.0);
    constexpr double kAside = 0.22;  // tangents of the angles off the axis
    const auto hit = view.first_hit(Vector3d(drawn(2, -kAside, kAside), drawn(3, -kAside, kAside), 1.0));
    constexpr double kMost_rad = 35.0 / 180.0 * std::numbers::pi;
    const double off_rad = drawn(4, 0.0, kMost_rad), about_rad = drawn(5, 0.0, 2.0 * std::numbers::pi);
    touch.axis_W = X_WC.R * Vector3d(std::sin(off_rad) * std::cos(about_rad), std::sin(off_rad) * std::sin(about_rad),
                                     -std::cos(off_rad));
    if (!hit) continue;
    touch.point = *hit;
    touches_.push_back(touch);
    begin_s = touch.end_s() + kBetween_s;
  }
}

SimulatedTool::Tip SimulatedTool::tip_of(const Touch& touch, double t_s, const GroundTruth& truth,
                                         Instant start) const {
  const double height = touch.height_mm(t_s);
  const Vector3d rest = truth.position(touch.point, start);
  const Vector3d now = truth.position(touch.point, start + from_seconds(t_s));
  const Vector3d anchor = rest + (1.0 - smooth(height / kFollows_mm)) * (now - rest);
  return {anchor + height * touch.axis_W, touch.axis_W, height == 0.0};
}

SimulatedTool::Tip SimulatedTool::tip_at(double t_s, const GroundTruth& truth, Instant start) const {
  if (touches_.empty()) return {Vector3d(0.0, 0.0, 1000.0), Vector3d::UnitZ(), false};
  const auto next = std::find_if(touches_.begin(), touches_.end(), [t_s](const Touch& t) { return t_s < t.end_s(); });
  if (next == touches_.end()) return tip_of(touches_.back(), t_s, truth, start);
  if (t_s >= next->begin_s || next == touches_.begin()) return tip_of(*next, t_s, truth, start);
  const Tip from = tip_of(*std::prev(next), t_s, truth, start), to = tip_of(*next, t_s, truth, start);
  const double share = smooth((t_s - std::prev(next)->end_s()) / kBetween_s);
  return {from.p_W_mm + share * (to.p_W_mm - from.p_W_mm),
          (from.axis_W + share * (to.axis_W - from.axis_W)).normalized(), false};
}

TrackerSample SimulatedTool::sample(std::size_t index, const TrackerNoise& noise) const noexcept {
  TrackerSample sample = samples_[index];
  const double per_axis = 1.0 / std::numbers::sqrt3;
  sample.X_WS.t += per_axis * noise.position_rms_mm * position_errors_[index];
  sample.X_WS.R *= so3_exp(per_axis * noise.rotation_rms_rad * rotation_errors_[index]);
  return sample;
}

std::string SimulatedTool::calibration() {
  const Vector3d tip = tip_O_mm();
  return fmt::format(
      "{{\"tool\": \"{}\", \"tip_mm\": [{}, {}, {}], \"covariance\": [[0, 0, 0], [0, 0, 0], [0, 0, 0]]}}\n", kName,
      tip.x(), tip.y(), tip.z());
}

}  // namespace perimap
