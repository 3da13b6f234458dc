#include "tests/simulated/still_camera_session.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "core/pipeline/batch_starter.hpp"
#include "core/pipeline/feature_finder.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "core/realtime/worker_team.hpp"
#include "drivers/image/camera_frame.hpp"

namespace perimap::test {
namespace {

constexpr Instant kBegun(std::chrono::seconds(100));
constexpr Duration kFrameDelay = std::chrono::milliseconds(10);
constexpr Duration kPoseEvery = std::chrono::microseconds(16667), kPoseDelay = std::chrono::milliseconds(2);
constexpr std::uint32_t kEcgSamples = 16;
constexpr Duration kEcgDelay = std::chrono::milliseconds(3);

EcgRecord usual_ecg() {
  auto record = load_ecg_record("100");
  if (!record) throw std::runtime_error(record.error().message);
  return *std::move(record);
}

PipelineSettings settings_of(const StillCameraSettings& settings) {
  PipelineSettings of_pipeline;
  of_pipeline.camera.width = settings.width;
  of_pipeline.camera.height = settings.height;
  of_pipeline.camera.fx = of_pipeline.camera.fy = settings.width;
  of_pipeline.camera.cx = 0.5 * settings.width;
  of_pipeline.camera.cy = 0.5 * settings.height;
  of_pipeline.pose.position_deviation_mm = settings.tracker_noise_mm;
  of_pipeline.features.maximum = settings.features;
  of_pipeline.features.minimum_distance_px = 12;
  of_pipeline.workers = settings.workers;
  of_pipeline.lockstep = true;
  return of_pipeline;
}

}  // namespace

StillCameraSession::StillCameraSession(const StillCameraSettings& settings)
    : settings_(settings), ecg_(usual_ecg()), pipeline_(settings_of(settings)) {
  for (int i = 0; i < pipeline_.team().size(); ++i) {
    threads_.emplace_back([this, i] { pipeline_.team().serve(i); });
  }
  threads_.emplace_back([this] { pipeline_.finder().serve(); });
  threads_.emplace_back([this] { pipeline_.starter().serve(); });
  threads_.emplace_back([this] { pipeline_.surface_maker().serve(); });
  threads_.emplace_back([this] { pipeline_.setup_watcher().serve(); });
}

StillCameraSession::~StillCameraSession() {
  pipeline_.team().dismiss();
  pipeline_.finder().dismiss();
  pipeline_.starter().dismiss();
  pipeline_.surface_maker().dismiss();
  pipeline_.setup_watcher().dismiss();
  for (std::thread& thread : threads_) thread.join();
}

void StillCameraSession::deliver_pose(Instant time) {
  std::normal_distribution<double> noise(0.0, settings_.tracker_noise_mm);
  TrackerSample sample;
  sample.source_time = time;
  sample.arrival = time + kPoseDelay;
  sample.device_frame = poses_++;
  sample.state = ToolState::kOk;
  for (int axis = 0; axis < 3; ++axis) sample.X_WS.t[axis] = noise(random_);
  pipeline_.entrance().push_pose(sample);
  pipeline_.drain_poses();
  release_until(sample.arrival);
}

void StillCameraSession::deliver_ecg() {
  EcgBlock block;
  block.sample_period = from_seconds(1.0 / ecg_.sample_rate_hz);
  block.first_sample_time = kBegun + ecg_samples_ * block.sample_period;
  block.device_sequence = ecg_samples_;
  block.count = kEcgSamples;
  for (std::uint32_t i = 0; i < kEcgSamples; ++i) block.mV[i] = ecg_.mV(ecg_samples_ + i);
  block.arrival = block.last_sample_time() + kEcgDelay;
  ecg_samples_ += kEcgSamples;
  pipeline_.entrance().push_ecg(block);
  release_until(block.arrival);
}

Instant StillCameraSession::next_ecg() const {
  const Duration period = from_seconds(1.0 / ecg_.sample_rate_hz);
  return kBegun + (ecg_samples_ + kEcgSamples - 1) * period + kEcgDelay;
}

Instant StillCameraSession::next_pose() const { return kBegun + poses_ * kPoseEvery + kPoseDelay; }

void StillCameraSession::deliver_next() {
  if (next_pose() <= next_ecg()) {
    deliver_pose(kBegun + poses_ * kPoseEvery);
  } else {
    deliver_ecg();
  }
}

void StillCameraSession::release_until(Instant now) {
  while (const auto next = pipeline_.plan().next()) {
    if (next->deadline > now) return;
    const SurfaceSample& sample = pipeline_.compose(pipeline_.plan().take_release());
    Told told{sample.state, sample.reason, sample.features.size(), 0};
    for (const SurfaceFeature& feature : sample.features) told.x_sum_mm += feature.p_WF_mm.x();
    told_.push_back(told);
    pipeline_.sent(sample);
  }
}

void StillCameraSession::deliver(const GreyImage& grey, const ColourImage& colour) {
  const Instant capture = kBegun + from_seconds(static_cast<double>(frames_) / settings_.frames_per_s);
  const FrameStamp stamp{++frames_, capture, capture + kFrameDelay};
  // What has come before it, in its order.
  while (std::min(next_pose(), next_ecg()) <= stamp.arrival) deliver_next();
  CameraFrame as_it_came;
  as_it_came.stamp = stamp;
  as_it_came.width = grey.width;
  as_it_came.height = grey.height;
  as_it_came.stride = static_cast<std::size_t>(grey.stride);
  as_it_came.bytes = std::as_bytes(std::span(grey.data, as_it_came.stride * static_cast<std::size_t>(grey.height)));
  as_it_came.colour = colour;
  colour_.reduce_colour(as_it_came);
  static_cast<void>(pipeline_.entrance().push_frame(stamp, grey, colour_.picture()));
  pipeline_.drain_stamps(stamp.arrival);
  // Until the tracker has told where the camera was.
  while (!pipeline_.pose_reached(capture)) deliver_next();
  FrameHandle frame;
  if (pipeline_.entrance().pop_frame(frame)) pipeline_.map(frame);
}

std::map<std::uint32_t, Vector2d> StillCameraSession::found() const {
  std::map<std::uint32_t, Vector2d> found;
  for (const FeatureSlot& slot : slots()) {
    const bool is_found = slot.state != SlotState::kEmpty && slot.match.state == MatchState::kFound;
    if (is_found) found[slot.id] = slot.match.px;
  }
  return found;
}

}  // namespace perimap::test
