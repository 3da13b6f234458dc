#include "drivers/standins/simulator/bench_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/slow_error.hpp"
#include "drivers/standins/simulator/transport_delay.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// Independent sequences of random numbers; none is one of Simulation's.
enum BenchStream : std::uint64_t {
  kBench = 101,
  kScopeTurn,
  kScopePlace,
  kPointerTurn,
  kBenchCameraDelay,
  kBenchTrackerDelay,
  kScopeError,
  kPointerError,
  kBenchImage,
  kLandmark,
  kSecondError,
  kBoardError,
  kBoardTurn,
  kBoardPlace
};

constexpr double kDistance_mm = 150.0;  // of the scope from the board, at rest
constexpr double kDwell_s = 2.5;        // on each landmark
constexpr double kMove_s = 1.5;         // from one to the next
constexpr std::size_t kLandmarks = 6;
constexpr double kTurnTakes_s = 2.0;

Expected<void> check_bench(const BenchSettings& s) {
  const auto outside = [](const char* what, double value, double low, double high, const char* unit) -> Expected<void> {
    if (value >= low && value <= high) return {};
    return fail(fmt::format("{}: {} is outside {} to {} {}", what, value, low, high, unit));
  };
  for (const Expected<void>& result :
       {outside("duration", to_seconds(s.duration), 1.0, 1700.0, "s"), outside("width", s.width, 64, 4096, "px"),
        outside("height", s.height, 64, 4096, "px"), outside("fps", s.frames_per_s, 1.0, 1000.0, "Hz"),
        outside("tracker rate", s.tracker_rate_hz, 1.0, 1000.0, "Hz"),
        outside("tracker correlation", to_seconds(s.tracker_correlation), 0.0, 1000.0, "s"),
        outside("swing", s.swing, 0.0, 3.0, "times the usual")}) {
    if (!result) return result;
  }
  if (s.second_sensor && !s.notch_rad) return fail("second sensor: expected a scope that is turned by some angle");
  if (!s.turns.empty() && !s.notch_rad) return fail("turns: expected a scope that is turned by some angle at first");
  Duration free{0};
  for (const BenchSettings::Turn& turn : s.turns) {
    if (turn.at < free) return fail("turns: expected each to begin two seconds after the one before and later");
    free = turn.at + from_seconds(kTurnTakes_s);
  }
  return {};
}

double smooth(double s) { return s * s * (3.0 - 2.0 * s); }

FieldStop field_stop_of(const BenchSettings& s, const ScopeHeld& held) {
  return drawn_field_stop(s.setup_seed, s.width, s.height, held);
}

BenchStream error_stream(BenchScene::Tool tool) {
  return tool == BenchScene::Tool::kScope     ? kScopeError
         : tool == BenchScene::Tool::kPointer ? kPointerError
         : tool == BenchScene::Tool::kBoard   ? kBoardError
                                              : kSecondError;
}

Vector3d drawn_vector(const CounterNoise& noise, std::uint64_t index, double half) {
  return {noise.uniform(3 * index, -half, half), noise.uniform(3 * index + 1, -half, half),
          noise.uniform(3 * index + 2, -half, half)};
}

}  // namespace

BenchScene::BenchScene(const BenchSettings& settings) : settings_(settings) {
  unturned_ = settings.setup_seed != 0 ? drawn_setup(settings.setup_seed, settings.width, settings.height)
                                       : usual_setup(settings.width, settings.height);
  setup_ = setup_at(Duration(0));
  const CounterNoise bench(settings.seed, kBench);
  start_ = Instant(from_seconds(bench.uniform(0, 3600.0, 7200.0)));
  X_WB_ = {so3_exp(drawn_vector(bench, 1, 1.2)), Vector3d(80.0, -40.0, -950.0) + drawn_vector(bench, 2, 120.0)};
  pointer_rest_ = so3_exp(drawn_vector(bench, 3, 1.0));
  const double swing = settings.swing;
  scope_turn_ = HandSway3(CounterNoise(settings.seed, kScopeTurn), 0, swing * Vector3d(0.50, 0.50, 0.9),
                          swing * Vector3d(0.10, 0.10, 0.12));
  scope_place_ = HandSway3(CounterNoise(settings.seed, kScopePlace), 0, swing * Vector3d(14.0, 10.0, 30.0),
                           swing * Vector3d(2.0, 2.0, 3.0));
  board_turn_ =
      HandSway3(CounterNoise(settings.seed, kBoardTurn), 0, Vector3d(0.15, 0.15, 0.2), Vector3d(0.03, 0.03, 0.03));
  board_place_ =
      HandSway3(CounterNoise(settings.seed, kBoardPlace), 0, Vector3d(25.0, 25.0, 15.0), Vector3d(3.0, 3.0, 2.0));
  pointer_turn_ =
      HandSway3(CounterNoise(settings.seed, kPointerTurn), 0, Vector3d(0.6, 0.6, 0.6), Vector3d(0.1, 0.1, 0.1));
}

Expected<BenchScene> BenchScene::create(const BenchSettings& settings) {
  if (const auto good = check_bench(settings); !good) return tl::unexpected(good.error());
  BenchScene scene(settings);
  scene.draw_landmarks();
  if (settings.act == BenchAct::kLandmarks) {
    scene.settings_.duration = from_seconds(static_cast<double>(kLandmarks) * (kDwell_s + kMove_s));
  }
  scene.time_devices();
  scene.draw_errors();
  if (settings.act == BenchAct::kBoard) {
    scene.renderers_.push_back(scene.renderer_at(Duration(0)));
    for (const BenchSettings::Turn& turn : settings.turns) {
      scene.renderers_.push_back(scene.renderer_at(turn.at + from_seconds(kTurnTakes_s)));
    }
  }
  return scene;
}

BenchScene::Turned BenchScene::turned_at(Duration since) const noexcept {
  Turned turned{{settings_.notch_rad.value_or(0.0), settings_.zoom}, 0U};
  for (std::size_t i = 0; i < settings_.turns.size(); ++i) {
    const BenchSettings::Turn& turn = settings_.turns[i];
    if (since <= turn.at) break;
    const double s = std::min(1.0, to_seconds(since - turn.at) / kTurnTakes_s);
    turned.held.notch_rad += smooth(s) * (turn.to.notch_rad - turned.held.notch_rad);
    turned.held.zoom += smooth(s) * (turn.to.zoom - turned.held.zoom);
    turned.times = s < 1.0 ? std::nullopt : std::optional(i + 1);
  }
  return turned;
}

ScopeSetup BenchScene::setup_at(Duration since) const noexcept {
  if (!settings_.notch_rad) return unturned_;
  const ScopeHeld held = turned_at(since).held;
  return turned_setup(unturned_, held, field_stop_of(settings_, held).centre_px);
}

std::shared_ptr<const BoardRenderer> BenchScene::renderer_at(Duration since) const {
  const bool stop_is_seen = settings_.notch_rad && !settings_.second_sensor;
  const FieldStop stop = stop_is_seen ? field_stop_of(settings_, turned_at(since).held) : FieldStop{};
  return std::make_shared<const BoardRenderer>(setup_at(since).lens, settings_.board, stop);
}

// Spread over a chest, no three on a line.
void BenchScene::draw_landmarks() {
  const CounterNoise noise(settings_.setup_seed + 1, kLandmark);
  for (std::size_t k = 0; k < kLandmarks; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / kLandmarks;
    const Vector3d round(90.0 * std::cos(angle), 70.0 * std::sin(angle), k % 2 == 0 ? 25.0 : -25.0);
    landmarks_.push_back({fmt::format("landmark {}", k + 1), round + drawn_vector(noise, k, 15.0)});
  }
}

void BenchScene::time_devices() {
  if (settings_.act == BenchAct::kBoard) {
    TransportDelay camera(CounterNoise(settings_.seed, kBenchCameraDelay), milliseconds(11), microseconds(1000));
    const auto count = static_cast<std::uint64_t>(to_seconds(settings_.duration) * settings_.frames_per_s);
    for (std::uint64_t k = 0; k < count; ++k) {
      const Instant t = start_ + from_seconds((static_cast<double>(k) + 0.5) / settings_.frames_per_s);
      frames_.push_back({k, t, camera.arrival(t, k)});
    }
  }
  TransportDelay tracker(CounterNoise(settings_.seed, kBenchTrackerDelay), milliseconds(7), microseconds(1000));
  const auto count = static_cast<std::uint64_t>(to_seconds(settings_.duration) * settings_.tracker_rate_hz);
  for (std::uint64_t k = 0; k < count; ++k) {
    const Instant t = start_ + from_seconds((static_cast<double>(k) + 0.5) / settings_.tracker_rate_hz);
    times_.push_back(t);
    arrivals_.push_back(tracker.arrival(t, k));
  }
}

void BenchScene::draw_errors() {
  for (const Tool tool : {Tool::kScope, Tool::kPointer, Tool::kSecondSensor, Tool::kBoard}) {
    const CounterNoise noise(settings_.seed, error_stream(tool));
    SlowError position(settings_.tracker_rate_hz, settings_.tracker_correlation);
    SlowError rotation = position;
    for (std::uint64_t k = 0; k < times_.size(); ++k) {
      errors_[static_cast<std::size_t>(tool)].push_back(
          {position.next(normal3(noise, 2 * k)), rotation.next(normal3(noise, 2 * k + 1))});
    }
  }
}

Pose BenchScene::X_WC(Duration since) const noexcept {
  const double t_s = settings_.act == BenchAct::kBoard ? to_seconds(since) : 0.0;
  const BoardRectangle& all = settings_.board.outline;
  const Vector3d middle_B(all.x_mm + 0.5 * all.width_mm, all.y_mm + 0.5 * all.height_mm, 0.0);
  const Pose swing{so3_exp(scope_turn_.at(t_s)), middle_B};
  return X_WB_ * swing * Pose{Matrix3d::Identity(), scope_place_.at(t_s) - Vector3d(0.0, 0.0, kDistance_mm)};
}

// Where the pointer's tip is.
Vector3d BenchScene::touched_W(double t_s) const noexcept {
  if (settings_.act != BenchAct::kLandmarks) return X_WB_.t;
  const Pose X_WI = setup_.X_IW.inverse();
  const double of_each_s = kDwell_s + kMove_s;
  const auto at = std::min(kLandmarks - 1, static_cast<std::size_t>(t_s / of_each_s));
  const double within_s = t_s - static_cast<double>(at) * of_each_s;
  Vector3d here = X_WI * landmarks_[at].p_I;
  if (within_s <= kDwell_s || at + 1 == kLandmarks) return here;
  const double s = smooth((within_s - kDwell_s) / kMove_s);
  const Vector3d next = X_WI * landmarks_[at + 1].p_I;
  const Vector3d lifted(0.0, 0.0, 40.0 * std::sin(std::numbers::pi * s));
  return here + s * (next - here) + X_WI.R * lifted;
}

Pose BenchScene::X_WT(Duration since) const noexcept {
  const double t_s = settings_.act == BenchAct::kStill ? 0.0 : to_seconds(since);
  const Matrix3d R = pointer_rest_ * so3_exp(pointer_turn_.at(t_s));
  return {R, touched_W(t_s) - R * setup_.tip_T};
}

// Camera and pointer are about the board wherever it is held, so that no picture changes.
Pose BenchScene::X_WW(Duration since) const noexcept {
  if (!settings_.board_is_held) return {};
  const double t_s = to_seconds(since);
  const Pose about{so3_exp(board_turn_.at(t_s)), board_place_.at(t_s)};
  return X_WB_ * about * X_WB_.inverse();
}

Pose BenchScene::true_pose(Tool tool, Duration since) const noexcept {
  const Pose moved = X_WW(since);
  if (tool == Tool::kPointer) return moved * X_WT(since);
  if (tool == Tool::kBoard) {
    const Pose X_BT{so3_exp(Vector3d(0.2, -0.3, 0.9)), Vector3d(-35.0, 20.0, 12.0)};  // its sensor, beside the squares
    return moved * X_WB_ * X_BT;
  }
  const ScopeSetup setup = settings_.turns.empty() ? setup_ : setup_at(since);
  const Pose X_WS = moved * X_WC(since) * setup.X_SC.inverse();
  return tool == Tool::kScope ? X_WS : X_WS * setup.X_SS2;
}

TrackerSample BenchScene::reading(Tool tool, std::size_t index, const TrackerNoise& noise) const noexcept {
  const Duration since = times_[index] - start_;
  const Pose truth = true_pose(tool, since);
  const Error& error = errors_[static_cast<std::size_t>(tool)][index];
  const double per_axis = 1.0 / std::numbers::sqrt3;
  TrackerSample sample;
  sample.source_time = times_[index] - setup_.tracker_offset;
  sample.arrival = arrivals_[index];
  sample.device_frame = static_cast<std::uint32_t>(index);
  sample.state = ToolState::kOk;
  sample.X_WS.t = truth.t + noise.position_rms_mm * per_axis * error.position;
  sample.X_WS.R = truth.R * so3_exp(noise.rotation_rms_rad * per_axis * error.rotation);
  return sample;
}

void BenchScene::render(std::size_t index, std::span<std::uint8_t> image) const {
  const Duration since = frames_[index].capture - start_;
  const Pose X_CB = X_WC(since).inverse() * X_WB_;
  // While it is turned each frame has a lens of its own.
  const auto held = turned_at(since).times;
  const auto renderer = held ? renderers_[*held] : renderer_at(since);
  renderer->render(X_CB, CounterNoise(settings_.seed, kBenchImage).bits(index), image);
}

}  // namespace perimap
