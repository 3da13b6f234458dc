#include "daemon/setup/live_recording.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/config/wrong_key.hpp"
#include "daemon/process/saved_signal_mask.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "daemon/setup/sight_of_tools.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {
namespace {

// In the words for the user, those that the guide follows.
std::vector<std::string> followed_tools(const LiveGuide& guide, const std::string& tool) {
  if (guide.followed() == Followed::kNone) return {};
  std::vector<std::string> named{tool == kScopeTool ? "the sensor" : fmt::format("the tool '{}'", tool)};
  if (guide.followed() == Followed::kBothSensors) named.emplace_back("the second sensor");
  return named;
}

// What the devices' threads leave for the guide: the newest frame, and all poses of the tool that matters and of a
// second sensor.
class Shown final : public FrameObserver {
 public:
  explicit Shown(std::vector<std::string> followed)
      : followed_(followed.size()), sight_(std::move(followed), MonotonicClock::now()) {}

  void frame(const CameraFrame& frame) override {
    const auto grey = converter_.convert(frame);
    if (!grey) return;
    const std::scoped_lock lock(mutex_);
    if (fresh_) return;  // the guide is still busy with the one before
    width_ = grey->width, height_ = grey->height;
    pixels_.clear();
    for (int y = 0; y < height_; ++y) {
      const auto* row = grey->data + y * grey->stride;
      pixels_.insert(pixels_.end(), row, row + width_);
    }
    t_s_ = to_seconds(frame.stamp.capture.time_since_epoch());
    fresh_ = true;
  }
  void pose(const TrackerSample& sample) { add(sample, 0, poses_); }
  void second_pose(const TrackerSample& sample) { add(sample, 1, second_poses_); }
  [[nodiscard]] std::string unseen_tools() {
    const std::scoped_lock lock(mutex_);
    return sight_.missing(MonotonicClock::now());
  }
  void tell(LiveGuide& guide) {
    bool fresh = false;
    {
      const std::scoped_lock lock(mutex_);
      fresh = fresh_;
      if (fresh) told_pixels_ = pixels_;
    }
    if (fresh) {
      told_ = {told_pixels_.data(), width_, height_, width_};
      guide.see(t_s_, told_);
      const std::scoped_lock lock(mutex_);
      fresh_ = false;
    }
    std::vector<TimedPose> poses, second_poses;
    {
      const std::scoped_lock lock(mutex_);
      poses = poses_;
      second_poses = second_poses_;
    }
    if (!poses.empty()) guide.follow(in_order(std::move(poses)));
    if (!second_poses.empty()) guide.follow_second(in_order(std::move(second_poses)));
  }
  // The newest that was told.
  [[nodiscard]] const GreyImage& picture() const { return told_; }

 private:
  void add(const TrackerSample& sample, std::size_t tool, std::vector<TimedPose>& poses) {
    const std::scoped_lock lock(mutex_);
    if (tool < followed_) sight_.take(tool, sample);
    if (sample.state != ToolState::kOk) return;
    poses.push_back({to_seconds(sample.source_time.time_since_epoch()), sample.X_WS});
  }

  GreyConverter converter_;  // of the camera's thread
  std::mutex mutex_;
  bool fresh_ = false;
  double t_s_ = 0.0;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
  std::vector<TimedPose> poses_;
  std::vector<TimedPose> second_poses_;
  std::size_t followed_;
  SightOfTools sight_;
  // Of the guide's thread.
  std::vector<std::uint8_t> told_pixels_;
  GreyImage told_;
};

Expected<std::filesystem::path> recording_file(const LiveSettings& settings) {
  if (!settings.keep.empty()) return std::filesystem::path(settings.keep);
  std::error_code error;
  const auto folder = std::filesystem::temp_directory_path(error);
  if (error) return fail("no folder for temporary files: " + error.message() + "; name a recording with --keep");
  return folder / fmt::format("perimap-calibrate-{}.mcap", ::getpid());
}

// What is recorded of.
struct LiveDevices {
  Configuration configuration;
  Devices devices;
  std::vector<std::string> names;  // of the tools beside the sensor, by ToolSample::tool
};

SetupExpected<LiveDevices> live_devices(const LiveSettings& settings, const std::string& tool) {
  auto configuration = load_configuration(settings.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return wrong_setup(configuration.error());
  if (settings.unregistered) {
    const TrackerConfiguration untold;
    std::copy_n(untold.translation_IW_mm, 3, configuration->tracker.translation_IW_mm);
    std::copy_n(untold.rotation_IW_wxyz, 4, configuration->tracker.rotation_IW_wxyz);
  }
  auto devices = named_devices(*configuration, settings.configuration);
  if (!devices) return wrong_setup(told_in(settings.configuration, devices.error()));
  if (!devices->tracker && !devices->camera) {
    return wrong_setup(settings.configuration +
                       ": names neither a camera nor a tracker; perimap setup writes one that does");
  }
  std::vector<std::string> names = tracked_tool_names(configuration->tracker);
  if (tool != kScopeTool && std::find(names.begin(), names.end(), tool) == names.end()) {
    return wrong_setup(
        fmt::format("{}: names no tool '{}' beside the sensor: name it as tracker.pointer or in "
                    "tracker.instruments",
                    settings.configuration, tool));
  }
  return LiveDevices{*std::move(configuration), *std::move(devices), std::move(names)};
}

}  // namespace

LiveRecording::~LiveRecording() {
  std::error_code ignored;
  if (!kept_) std::filesystem::remove(file_, ignored);
}

SetupExpected<LiveRecording> record_live(const LiveSettings& settings, const std::string& tool, LiveGuide& guide,
                                         const LiveTold& told) {
  const SavedSignalMask as_before;  // what is measured after this may be interrupted
  auto stop = StopSignal::install();
  if (!stop) return tl::unexpected(stop.error());
  auto named = live_devices(settings, tool);
  if (!named) return tl::unexpected(std::move(named.error()));
  const Configuration& configuration = named->configuration;
  Devices& devices = named->devices;
  const std::vector<std::string>& names = named->names;
  const auto file = recording_file(settings);
  if (!file) return tl::unexpected(file.error());
  auto recorder =
      SessionRecorder::create(*file, recording_facts(configuration, std::nullopt, "perimap calibrate " PERIMAP_VERSION),
                              static_cast<std::size_t>(configuration.recording.memory_MB) << 20U);
  if (!recorder) return tl::unexpected(recorder.error());
  LiveRecording recording(*file, !settings.keep.empty());

  Shown shown(devices.tracker ? followed_tools(guide, tool) : std::vector<std::string>{});
  Interrupt interrupt;
  DeviceHealth camera_health;
  DeviceHealth tracker_health;
  ThreadLauncher launcher({});
  (*recorder)->start(launcher);
  std::vector<std::jthread> threads;
  std::unique_ptr<ReplayFeeder> playback;
  if (auto* played = devices.camera ? std::get_if<CameraPlayback>(&*devices.camera) : nullptr) {
    const SensorIntake intake{nullptr, recorder->get(), &shown};
    playback = std::make_unique<ReplayFeeder>(std::move(played->reader), intake, played->offset);
    playback->start(launcher);
  } else if (devices.camera) {
    threads.emplace_back([&] {
      const CameraSink sink = [&](const CameraFrame& frame) {
        (*recorder)->frame(frame);
        shown.frame(frame);
      };
      // What goes wrong is in its health, and told below.
      static_cast<void>(serve_camera(*devices.camera, sink, camera_health, interrupt));
    });
  }
  if (devices.tracker) {
    threads.emplace_back([&] {
      const TrackerSink sink = [&](const TrackerSample& sample) {
        (*recorder)->pose(sample);
        if (tool == kScopeTool) shown.pose(sample);
      };
      const ToolSink tools = [&](const ToolSample& sample) {
        (*recorder)->tool(sample);
        if (sample.tool >= names.size()) return;
        if (names[sample.tool] == tool) shown.pose(sample);
        if (names[sample.tool] == kSecondSensorTool) shown.second_pose(sample);
      };
      serve_tracker(*devices.tracker, sink, tools, tracker_health, interrupt);
    });
  }
  const Instant begin = MonotonicClock::now();
  constexpr Duration kTick = std::chrono::milliseconds(200);
  for (;;) {
    const bool stopped = stop->wait_for(kTick);
    const double elapsed_s = to_seconds(MonotonicClock::now() - begin);
    shown.tell(guide);
    std::string line = guide.line();
    for (const DeviceHealth* health : {&camera_health, &tracker_health}) {
      // Of one that delivers it is why it once did not.
      const std::string reason = health->state() == DeviceState::kStreaming ? "" : health->reason();
      if (!reason.empty()) line += "; " + reason;
    }
    const std::string unseen = tracker_health.state() == DeviceState::kStreaming ? shown.unseen_tools() : "";
    if (!unseen.empty()) line.insert(0, unseen + "; ");
    told({elapsed_s, std::move(line), guide.seen_of_ninths(), shown.picture()});
    if (stopped || guide.enough() || elapsed_s >= settings.longest_s || (*recorder)->summary().stopped) break;
  }
  interrupt.request();
  threads.clear();
  if (playback) playback->stop();
  (*recorder)->stop();
  if (playback && playback->error()) return fail(playback->error()->message);
  if ((*recorder)->summary().stopped) return fail((*recorder)->reason());
  if ((*recorder)->summary().recorded == 0) {
    return fail(fmt::format("no device gave anything: perimap probe {} says why", settings.configuration));
  }
  return recording;
}

}  // namespace perimap
