#include "drivers/standins/simulator/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/angle/angle.hpp"
#include "drivers/standins/procedure/procedure_effects.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/ecg_script.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"
#include "drivers/standins/simulator/picture_look.hpp"
#include "drivers/standins/simulator/procedure_truth.hpp"
#include "drivers/standins/simulator/scope_path.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "drivers/standins/simulator/session_ecg.hpp"
#include "drivers/standins/simulator/slow_error.hpp"
#include "drivers/standins/simulator/stretches.hpp"
#include "drivers/standins/simulator/transport_delay.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// Independent sequences of random numbers.
enum Stream : std::uint64_t {
  kSession = 1,
  kCameraDelay,
  kTrackerDelay,
  kEcgDelay,
  kTrackerPeriod,
  kTrackerPosition,
  kTrackerRotation,
  kTrackerDropout,
  kImage,
  kSecondPosition,
  kSecondRotation,
  kTrackerDisturbance,
  kPatientPosition,
  kPatientRotation
};

constexpr std::size_t kEcgSamplesPerBlock = 4;
// What comes again and again in a loop.
constexpr Duration kEcgLoop = std::chrono::seconds(1);
constexpr Duration kCameraLoop = std::chrono::seconds(2);

// The heart (frame H of its table: x left, y posterior, z superior) as it lies in the tracker's frame.
Pose X_WH() noexcept { return {so3_exp(Vector3d(0.4, -0.7, 1.1)), heart_place_W()}; }
// From the heart towards the scope: the anterior and left lateral wall faces it, the valves do not.
Vector3d view_axis_H() noexcept { return Vector3d(0.45, -0.80, -0.38).normalized(); }
Vector3d up_H() noexcept { return {0.0, 0.0, 1.0}; }
// Inspiration moves the heart down and forward.
Vector3d inspiration_H() noexcept { return Vector3d(0.10, -0.35, -0.93).normalized(); }
constexpr double kScopeDistance_mm = 120.0;  // from the heart's surface, at rest

struct Interval {
  Duration begin, end;
};

// At most one dropout in each equal part of the session, so that they are spread and as many as asked for.
std::vector<Interval> dropouts(std::uint64_t seed, Duration duration, double per_min) {
  const CounterNoise noise(seed, kTrackerDropout);
  const auto count = static_cast<std::uint64_t>(std::ceil(per_min * to_seconds(duration) / 60.0 - 1e-9));
  std::vector<Interval> intervals;
  for (std::uint64_t i = 0; i < count; ++i) {
    const double part = to_seconds(duration) / static_cast<double>(count);
    const double length = std::min(noise.uniform(2 * i, 0.05, 0.30), 0.5 * part);
    const double begin = (static_cast<double>(i) + noise.uniform(2 * i + 1) * (1.0 - length / part)) * part;
    intervals.push_back({from_seconds(begin), from_seconds(begin + length)});
  }
  return intervals;
}

HeartMotion heart_motion(const SimulationSettings& settings, const EcgScript& script, Instant start) {
  HeartMotion motion;
  motion.law = settings.law;
  motion.r_peaks = r_peaks_of(script, start, settings.duration);
  if (settings.respiration_mm > 0.0) {
    motion.respiration_mm = settings.respiration_mm * (X_WH().R * inspiration_H());
    motion.respiration_period = settings.respiration_period;
  }
  return motion;
}

// Where the scope looks from, and at what.
struct View {
  std::vector<Vector3d> material_W;
  Vector3d centre_W = Vector3d::Zero();
  Vector3d axis_W = Vector3d::Zero();
  Vector3d surface_W = Vector3d::Zero();
};

// The scope rests above the point of the surface that faces it.
Expected<View> view_of(const HeartMesh& mesh_W, const HeartMotion& motion) {
  View view;
  view.material_W.resize(mesh_W.vertex_count);
  vertex_positions(mesh_W, fourier_basis(0.0, mesh_W.harmonics), view.material_W);
  for (const Vector3d& p : view.material_W) view.centre_W += p / static_cast<double>(view.material_W.size());
  view.axis_W = X_WH().R * view_axis_H();
  auto still = GroundTruth::create(mesh_W, motion);
  if (!still) return tl::unexpected(still.error());
  const Pose far{Matrix3d::Identity(), view.centre_W + 300.0 * view.axis_W};
  const auto facing = still->first_hit(far, -view.axis_W, motion.r_peaks.front());
  if (!facing) return fail("heart mesh: the scope's axis misses it");
  view.surface_W = still->position(*facing, motion.r_peaks.front());
  return view;
}

// Where the camera is when the scope is drawn back along its axis.
Pose drawn_back(Pose X_WC, const Procedure& procedure, Duration since) noexcept {
  if (!procedure.empty()) X_WC.t -= drawn_back_mm(procedure, since) * X_WC.R.col(2);
  return X_WC;
}

// Frame times of a free-running sensor, with the jitter of its stamps' quantisation; the camera as it was when they
// were taken.
std::vector<Simulation::Frame> frames_of(const SimulationSettings& settings, Instant start, const ScopePath& path) {
  const std::vector<Drift> delays = camera_delays(settings.procedure, start);
  std::vector<Simulation::Frame> frames;
  const auto count = static_cast<std::uint64_t>(to_seconds(settings.duration) * settings.frames_per_s);
  TransportDelay camera(CounterNoise(settings.seed, kCameraDelay), milliseconds(11), microseconds(1000));
  const double offset_s = 0.5 / settings.frames_per_s;
  for (std::uint64_t k = 0; k < count; ++k) {
    const Duration since = from_seconds(offset_s + static_cast<double>(k) / settings.frames_per_s);
    const Duration taken = since - drifted(delays, start + since);
    frames.push_back({{k, start + since, camera.arrival(start + since, k)},
                      drawn_back(path.X_WC(taken), settings.procedure, taken)});
  }
  return frames;
}

}  // namespace

Simulation::Simulation(SimulationSettings settings, Instant start, GroundTruth truth, ScopeSetup setup,
                       Vector3d surface_W, const ScopePath& path)
    : settings_(std::move(settings)),
      start_(start),
      truth_(std::move(truth)),
      setup_(std::move(setup)),
      path_(path),
      obstacles_(settings_.seed, setup_.lens.width, setup_.lens.height, settings_.instrument, settings_.glints,
                 settings_.smoke),
      procedure_view_(settings_.seed, {path_.X_WR().R, surface_W}, setup_.lens.width, setup_.lens.height),
      surface_W_(std::move(surface_W)) {}

std::int64_t Simulation::utc_minus_monotonic_ns() const noexcept { return 1'750'000'000'000'000'000; }

Pose Simulation::X_WC_at(Duration since) const noexcept {
  return drawn_back(path_.X_WC(since), settings_.procedure, since);
}

bool Simulation::scope_turns() const noexcept { return settings_.turn || settings_.procedure.has<ScopeTurnedInHead>(); }

ScopeTurning Simulation::turning_at(Duration since) const noexcept {
  if (!settings_.turn) return scope_turning(settings_.procedure, since);
  const bool over = since >= settings_.turn->at + settings_.turn->length;
  return {!over && since > settings_.turn->at, over ? 1U : 0U};
}

// Turned as a hand does: it begins and ends gently.
std::optional<ScopeHeld> Simulation::held_at(Duration since) const noexcept {
  if (settings_.held && settings_.procedure.has<ScopeTurnedInHead>()) {
    const ScopeAsHeld first{settings_.held->notch_rad / kDegree, settings_.held->zoom};
    const ScopeAsHeld now = turned_scope(settings_.procedure, first, since);
    return ScopeHeld{now.notch_deg * kDegree, now.zoom};
  }
  if (!settings_.held || !settings_.turn) return settings_.held;
  const SimulationSettings::Turn& turn = *settings_.turn;
  const double s = std::clamp(to_seconds(since - turn.at) / to_seconds(turn.length), 0.0, 1.0);
  const double share = s * s * (3.0 - 2.0 * s);
  const ScopeHeld& from = *settings_.held;
  return ScopeHeld{from.notch_rad + share * (turn.to.notch_rad - from.notch_rad),
                   from.zoom + share * (turn.to.zoom - from.zoom)};
}

CameraTruth Simulation::camera_truth(const Frame& frame) const noexcept {
  CameraTruth truth{frame.stamp.capture, frame.X_WC};
  const Duration since = truth_.taken_at(frame.stamp.capture) - start_;
  if (const auto held = held_at(since)) {
    const ScopeLens lens = setup_at(since).lens;
    truth.focal_px = {lens.fx, lens.fy};
    truth.principal_px = {lens.cx, lens.cy};
    truth.scope_rotation_rad = held->notch_rad;
  }
  return truth;
}

FieldStop Simulation::field_stop_at(Duration since) const noexcept {
  const auto held = held_at(since);
  return held ? drawn_field_stop(settings_.setup_seed, settings_.width, settings_.height, *held) : FieldStop{};
}

ScopeSetup Simulation::setup_at(Duration since) const noexcept {
  const auto held = held_at(since);
  return held ? turned_setup(setup_, *held, field_stop_at(since).centre_px) : setup_;
}

FieldStop Simulation::seen_field_stop_at(Duration since) const noexcept {
  return settings_.second_sensor ? FieldStop{} : field_stop_at(since);
}

std::unique_ptr<const SceneRenderer> Simulation::renderer_at(Duration since) const {
  return std::make_unique<const SceneRenderer>(setup_at(since).lens, truth_.mesh().triangles, *texture_,
                                               picture_look(settings_.look), seen_field_stop_at(since));
}

// Its own period wavers a little.
void Simulation::read_tracker() {
  const auto gaps = dropouts(settings_.seed, settings_.duration, settings_.tracker_dropouts_per_min);
  const Pose X_CS = setup_at(Duration(0)).X_SC.inverse();
  const CounterNoise period(settings_.seed, kTrackerPeriod);
  const CounterNoise position(settings_.seed, kTrackerPosition);
  const CounterNoise rotation(settings_.seed, kTrackerRotation);
  const CounterNoise disturbance(settings_.seed, kTrackerDisturbance);
  const std::vector<Drift> delays = tracker_delays(settings_.procedure, start_);
  SlowError position_error(settings_.tracker_rate_hz, settings_.tracker_correlation);
  SlowError rotation_error = position_error;
  TransportDelay tracker(CounterNoise(settings_.seed, kTrackerDelay), milliseconds(7), microseconds(1000));
  const auto reading_count = static_cast<std::uint64_t>(to_seconds(settings_.duration) * settings_.tracker_rate_hz);
  for (std::uint64_t k = 0; k < reading_count; ++k) {
    const Duration since =
        from_seconds((static_cast<double>(k) + period.uniform(k, -0.02, 0.02) + 0.5) / settings_.tracker_rate_hz);
    bool missing = std::any_of(gaps.begin(), gaps.end(),
                               [&](const Interval& gap) { return since >= gap.begin && since < gap.end; });
    const bool stuck = k > 0 && stretch_of(settings_.tracker_stuck, since) != nullptr;
    Pose X_WS = X_WC_at(since) * (scope_turns() ? setup_at(since).X_SC.inverse() : X_CS);
    Duration late{0};
    if (!settings_.procedure.empty()) {
      const TrackerTrouble trouble = tracker_trouble(settings_.procedure, since);
      missing = missing || trouble.hidden;
      X_WS.t += trouble.shift_mm + trouble.deviation_mm * normal3(disturbance, k);
      X_WS.R = so3_exp(Vector3d(0.0, 0.0, trouble.turn_rad)) * X_WS.R;
      late = drifted(delays, start_ + since);
    }
    // Data that come sooner than usual still come after they were measured.
    const Duration sent = since + std::max(late, Duration(-milliseconds(6)));
    tracker_stamps_.push_back({start_ + since + late - setup_.tracker_offset, tracker.arrival(start_ + sent, k),
                               stuck ? tracker_stamps_.back().reads : static_cast<std::size_t>(k), missing, X_WS,
                               position_error.next(normal3(position, k)), rotation_error.next(normal3(rotation, k))});
  }
}

// Together with the sensor, and as far off.
void Simulation::read_second_sensor() {
  if (!settings_.second_sensor) return;
  const CounterNoise position(settings_.seed, kSecondPosition);
  const CounterNoise rotation(settings_.seed, kSecondRotation);
  SlowError position_error(settings_.tracker_rate_hz, settings_.tracker_correlation);
  SlowError rotation_error = position_error;
  for (std::size_t k = 0; k < tracker_stamps_.size(); ++k) {
    TrackerStamp stamp = tracker_stamps_[k];
    const Duration since = stamp.source_time + setup_.tracker_offset - start_;
    const bool stuck = k > 0 && stretch_of(settings_.second_stuck, since) != nullptr;
    stamp.reads = stuck ? second_stamps_.back().reads : k;
    stamp.missing = stretch_of(settings_.second_lost, since) != nullptr;
    stamp.X_WS = stamp.X_WS * setup_at(since).X_SS2;
    stamp.position_error = position_error.next(normal3(position, k));
    stamp.rotation_error = rotation_error.next(normal3(rotation, k));
    second_stamps_.push_back(stamp);
  }
}

// Fixed to the organ beside what the scope looks at, and measured together with the sensor; metal about the scope does
// not reach it.
void Simulation::read_patient_tool() {
  if (!settings_.patient_tool) return;
  const CounterNoise position(settings_.seed, kPatientPosition);
  const CounterNoise rotation(settings_.seed, kPatientRotation);
  const Pose at_first{path_.X_WR().R, surface_W_ + path_.X_WR().R * Vector3d(45.0, 20.0, 10.0)};
  SlowError position_error(settings_.tracker_rate_hz, settings_.tracker_correlation);
  SlowError rotation_error = position_error;
  for (std::size_t k = 0; k < tracker_stamps_.size(); ++k) {
    TrackerStamp stamp = tracker_stamps_[k];
    stamp.reads = k;
    stamp.missing = false;
    stamp.X_WS = truth_.organ().at(stamp.source_time + setup_.tracker_offset).carried(at_first);
    stamp.position_error = position_error.next(normal3(position, k));
    stamp.rotation_error = rotation_error.next(normal3(rotation, k));
    patient_stamps_.push_back(stamp);
  }
}

// Small blocks, sent when their last sample is there.
void Simulation::read_ecg(const EcgScript& script) {
  TransportDelay ecg(CounterNoise(settings_.seed, kEcgDelay), milliseconds(4), microseconds(800));
  const auto sample_count = static_cast<std::uint32_t>(to_seconds(settings_.duration) * script.sample_rate_hz());
  for (std::uint32_t k = 0; k + kEcgSamplesPerBlock <= sample_count; k += kEcgSamplesPerBlock) {
    EcgBlock block;
    block.first_sample_time = script.time_of(start_, k);
    block.sample_period = from_seconds(1.0 / script.sample_rate_hz());
    block.arrival = ecg.arrival(script.time_of(start_, k + kEcgSamplesPerBlock - 1), k);
    block.device_sequence = k;
    block.count = kEcgSamplesPerBlock;
    const Duration since = block.first_sample_time - start_;
    block.lead_off = stretch_of(settings_.ecg_off, since) != nullptr || leads_off(settings_.procedure, since);
    for (std::uint32_t i = 0; i < block.count && !block.lead_off; ++i) {
      const std::size_t sample = looped(settings_.ecg_loops, k + i, script.sample_rate_hz(), kEcgLoop);
      block.mV[i] = script.mV(static_cast<std::uint32_t>(sample));
      if (!settings_.procedure.empty())
        block.mV[i] += static_cast<float>(arc_mV(settings_.procedure, settings_.seed, since, k + i));
    }
    ecg_.push_back(block);
  }
}

// The lung's volume goes with the displacement; the monitor's figure in litres, say.
void Simulation::read_respiration() {
  constexpr Duration kRespirationPeriod = milliseconds(8);
  constexpr std::uint32_t kRespirationSamplesPerBlock = 4;
  const HeartMotion& heart = truth_.motion();
  const double full_mm = heart.respiration_mm.norm();
  for (std::uint32_t k = 0; settings_.respiration_channel && k * kRespirationPeriod < settings_.duration;
       k += kRespirationSamplesPerBlock) {
    RespirationBlock block;
    block.first_sample_time = start_ + k * kRespirationPeriod;
    block.sample_period = kRespirationPeriod;
    block.arrival = block.first_sample_time + kRespirationSamplesPerBlock * kRespirationPeriod;
    block.device_sequence = k;
    block.count = kRespirationSamplesPerBlock;
    for (std::uint32_t i = 0; i < block.count && full_mm > 0.0; ++i) {
      const Instant t = block.first_sample_time + i * kRespirationPeriod;
      block.values[i] = static_cast<float>(0.5 * respiration_displacement(heart, t).norm() / full_mm);
    }
    respiration_.push_back(block);
  }
}

void Simulation::order_arrivals() {
  const auto add = [&](Instant arrival, Source source, std::size_t index) {
    arrivals_.push_back({arrival, source, static_cast<std::uint32_t>(index)});
  };
  for (std::size_t i = 0; i < frames_.size(); ++i) add(frames_[i].stamp.arrival, Source::kCamera, i);
  for (std::size_t i = 0; i < tracker_stamps_.size(); ++i) add(tracker_stamps_[i].arrival, Source::kTracker, i);
  for (std::size_t i = 0; i < ecg_.size(); ++i) add(ecg_[i].arrival, Source::kEcg, i);
  for (std::size_t i = 0; i < respiration_.size(); ++i) add(respiration_[i].arrival, Source::kRespiration, i);
  // Stable: what arrives in the same nanosecond keeps the order above.
  std::stable_sort(arrivals_.begin(), arrivals_.end(),
                   [](const Arrival& a, const Arrival& b) { return a.arrival < b.arrival; });
}

Expected<Simulation> Simulation::create(const SimulationSettings& settings, const ParallelFor& parallel_for) {
  if (const auto good = check(settings); !good) return tl::unexpected(good.error());
  const auto script = session_ecg(settings);
  if (!script) return tl::unexpected(script.error());
  auto mesh_H = parse_heart_mesh(embedded_epicardium_fourier_csv(), embedded_epicardium_faces_csv());
  if (!mesh_H) return tl::unexpected(mesh_H.error());
  HeartMesh mesh_W = transformed(X_WH(), *std::move(mesh_H));
  if (settings.trace) mesh_W = at_rest(mesh_W);

  // A host that has been up for an hour or two.
  const Instant start{from_seconds(CounterNoise(settings.seed, kSession).uniform(1, 3600.0, 7200.0))};
  const HeartMotion motion = heart_motion(settings, *script, start);
  const auto view = view_of(mesh_W, motion);
  if (!view) return tl::unexpected(view.error());
  const ScopePath path(settings.seed, view->surface_W + kScopeDistance_mm * view->axis_W, view->centre_W,
                       X_WH().R * up_H(), settings.scope_sweep);

  std::vector<Frame> frames = frames_of(settings, start, path);
  std::vector<CameraTruth> cameras;
  for (const Frame& frame : frames) cameras.push_back({frame.stamp.capture, frame.X_WC});
  auto truth = GroundTruth::create(mesh_W, motion, std::move(cameras));
  if (!truth) return tl::unexpected(truth.error());
  if (settings.trace) {
    const auto played = PlayedTrace::create(settings.trace, settings.seed);
    if (!played) return tl::unexpected(played.error());
    constexpr double kMargin_s = 1.0;
    auto moved = truth->set_trace(
        played->surface({path.X_WR().R, view->surface_W}, start, kMargin_s, to_seconds(settings.duration) + kMargin_s));
    if (!moved) return tl::unexpected(moved.error());
  }
  if (!settings.procedure.empty()) {
    auto organ = OrganMotion::create(organ_moves(settings.procedure, start, {path.X_WR().R, view->surface_W}));
    if (!organ) return tl::unexpected(organ.error());
    truth->set_procedure(*std::move(organ), camera_delays(settings.procedure, start));
  }
  const ScopeSetup setup = settings.setup_seed != 0 ? drawn_setup(settings.setup_seed, settings.width, settings.height)
                                                    : usual_setup(settings.width, settings.height);
  Simulation simulation(settings, start, *std::move(truth), setup, view->surface_W, path);
  simulation.frames_ = std::move(frames);
  simulation.read_tracker();
  simulation.read_second_sensor();
  simulation.read_patient_tool();
  simulation.read_ecg(*script);
  simulation.read_respiration();
  simulation.order_arrivals();

  // A texel a pixel or more, at rest.
  const int texture_size = std::min(
      4096, static_cast<int>(std::bit_ceil(static_cast<unsigned>(3 * std::max(settings.width, settings.height)))));
  const auto texture_seed = static_cast<std::uint32_t>(CounterNoise(settings.seed, kSession).bits(2));
  const auto& triangles = simulation.truth_.mesh().triangles;
  simulation.texture_ =
      std::make_unique<const TissueTexture>(view->material_W, triangles, view->centre_W, view->axis_W, texture_size,
                                            picture_look(settings.look).tissue, texture_seed, parallel_for);
  simulation.renderers_.push_back(simulation.renderer_at(Duration(0)));
  if (settings.turn) simulation.renderers_.push_back(simulation.renderer_at(settings.turn->at + settings.turn->length));
  for (const ProcedureEvent& event : settings.procedure.events) {
    if (std::holds_alternative<ScopeTurnedInHead>(event.what)) {
      simulation.renderers_.push_back(simulation.renderer_at(event.end()));
    }
  }
  return simulation;
}

TrackerSample Simulation::tracker_sample(std::size_t index, const TrackerNoise& noise) const noexcept {
  const TrackerStamp& stamp = tracker_stamps_[index];
  return sample_of(stamp, tracker_stamps_[stamp.reads], index, noise);
}

TrackerSample Simulation::second_sample(std::size_t index, const TrackerNoise& noise) const noexcept {
  const TrackerStamp& stamp = second_stamps_[index];
  return sample_of(stamp, second_stamps_[stamp.reads], index, noise);
}

TrackerSample Simulation::patient_sample(std::size_t index, const TrackerNoise& noise) const noexcept {
  const TrackerStamp& stamp = patient_stamps_[index];
  return sample_of(stamp, stamp, index, noise);
}

TrackerSample Simulation::sample_of(const TrackerStamp& stamp, const TrackerStamp& reading, std::size_t index,
                                    const TrackerNoise& noise) noexcept {
  TrackerSample sample;
  sample.source_time = stamp.source_time;
  sample.arrival = stamp.arrival;
  sample.device_frame = static_cast<std::uint32_t>(index);
  if (reading.missing) {
    sample.state = ToolState::kMissing;
    sample.X_WS.R.setConstant(std::numeric_limits<double>::quiet_NaN());
    sample.X_WS.t.setConstant(std::numeric_limits<double>::quiet_NaN());
    return sample;
  }
  const double per_axis = 1.0 / std::numbers::sqrt3;
  sample.state = ToolState::kOk;
  sample.X_WS.t = reading.X_WS.t + noise.position_rms_mm * per_axis * reading.position_error;
  sample.X_WS.R = reading.X_WS.R * so3_exp(noise.rotation_rms_rad * per_axis * reading.rotation_error);
  return sample;
}

std::size_t Simulation::pictured(std::size_t index) const noexcept {
  const auto* stuck = stretch_of(settings_.camera_stuck, frames_[index].stamp.capture - start_);
  while (stuck != nullptr && index > 0 && frames_[index].stamp.capture - start_ >= stuck->begin) --index;
  index = looped(settings_.camera_loops, index, settings_.frames_per_s, kCameraLoop);
  return index - index % static_cast<std::size_t>(settings_.camera_repeats);
}

void Simulation::render(std::size_t frame_index, RenderWorkspace& workspace, std::span<std::uint8_t> image) const {
  const std::size_t index = pictured(frame_index);
  const Frame& frame = frames_[index];
  const Instant taken = truth_.taken_at(frame.stamp.capture);
  const Duration since = taken - start_;
  // While it is turned each frame has a lens of its own.
  const ScopeTurning turns = turning_at(since);
  const SceneRenderer* held = renderers_[turns.turns].get();
  std::unique_ptr<const SceneRenderer> turning;
  if (turns.under_way) {
    turning = renderer_at(since);
    held = turning.get();
  }
  const SceneRenderer& renderer = *held;
  std::vector<Vector3d> vertices_W(truth_.mesh().vertex_count);
  // Instants spread evenly over the exposure; its middle alone when it is short.
  constexpr int kInstants = 3;
  const int instants = settings_.exposure_share > 0.0 ? kInstants : 1;
  const double exposure_s = settings_.exposure_share / settings_.frames_per_s;
  const FrameLight light = frame_light(settings_.look, settings_.seed, since);
  for (int k = 0; k < instants; ++k) {
    const Instant t = taken + from_seconds(exposure_s * ((k + 0.5) / instants - 0.5));
    const Pose X_WC = instants == 1 ? frame.X_WC : X_WC_at(t - start_);
    truth_.vertices_at(t, vertices_W);
    renderer.light(X_WC, vertices_W, (frame.X_WC.t - surface_W_).norm(), light, workspace);
    obstacles_.draw(t - start_, workspace.radiance);
    if (!settings_.procedure.empty()) {
      procedure_view_.draw(picture_state(settings_.procedure, t - start_),
                           {t - start_, X_WC, setup_at(since).lens, index}, workspace.blurred, workspace.radiance);
    }
    if (instants == 1) break;
    if (k == 0) workspace.exposure.assign(workspace.radiance.size(), 0.0F);
    for (std::size_t i = 0; i < workspace.radiance.size(); ++i) {
      workspace.exposure[i] += workspace.radiance[i] / static_cast<float>(instants);
    }
  }
  if (instants > 1) workspace.radiance.swap(workspace.exposure);
  renderer.expose(light, CounterNoise(settings_.seed, kImage).bits(index), workspace, image);
}

}  // namespace perimap
