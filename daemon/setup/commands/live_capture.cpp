#include "daemon/setup/commands/live_capture.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/status_line.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/process/saved_signal_mask.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "daemon/setup/recorded_poses.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {
namespace {

// What the devices' threads leave for the guide: the newest frame, and all poses of the tool that matters.
class Shown final : public FrameObserver {
 public:
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
  void pose(const TrackerSample& sample) {
    if (sample.state != ToolState::kOk) return;
    const std::scoped_lock lock(mutex_);
    poses_.push_back({to_seconds(sample.source_time.time_since_epoch()), sample.X_WS});
  }
  void tell(LiveGuide& guide) {
    std::vector<std::uint8_t> pixels;
    {
      const std::scoped_lock lock(mutex_);
      if (fresh_) pixels = pixels_;
    }
    if (!pixels.empty()) {
      guide.see(t_s_, {pixels.data(), width_, height_, width_});
      const std::scoped_lock lock(mutex_);
      fresh_ = false;
    }
    std::vector<TimedPose> poses;
    {
      const std::scoped_lock lock(mutex_);
      poses = poses_;
    }
    if (!poses.empty()) guide.follow(in_order(std::move(poses)));
  }

 private:
  GreyConverter converter_;  // of the camera's thread
  std::mutex mutex_;
  bool fresh_ = false;
  double t_s_ = 0.0;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> pixels_;
  std::vector<TimedPose> poses_;
};

// A line on a terminal, or one every five seconds elsewhere.
class Lines {
 public:
  explicit Lines(const Console& console) : line_(console) {}
  void show(double elapsed_s, const std::string& line) {
    if (!line_.on_terminal() && elapsed_s < next_s_) return;
    line_.show(fmt::format("{:.0f} s: {}", elapsed_s, line));
    constexpr double kEvery_s = 5.0;
    next_s_ = elapsed_s + kEvery_s;
  }

 private:
  StatusLine line_;
  double next_s_ = 0.0;
};

Expected<std::filesystem::path> recording_file(const LiveOptions& options) {
  if (!options.keep.empty()) return std::filesystem::path(options.keep);
  std::error_code error;
  const auto folder = std::filesystem::temp_directory_path(error);
  if (error) return fail("no folder for temporary files: " + error.message() + "; name a recording with --keep");
  return folder / fmt::format("perimap-calibrate-{}.mcap", ::getpid());
}

}  // namespace

void add_live(Command& command, LiveOptions& options) {
  command.add_option("--live", options.configuration,
                     "The devices of this configuration (TOML) in place of files: they are recorded, and you are told "
                     "what is missing");
  command.add_option("--seconds", options.longest_s, "With --live: for so long at most")
      ->check(Range(5.0, 3600.0))
      ->capture_default_str();
  command.add_option("--keep", options.keep,
                     "With --live: where the recording stays; it must not be there yet [nowhere]");
}

SetupExpected<std::unique_ptr<LiveGuide>> live_board_guide(const LiveOptions& options, const RecordedOptions& recorded,
                                                           const std::string& configuration, double least_s) {
  const auto wish = wish_of(recorded.board);
  if (!wish) return tl::unexpected(wish.error());
  std::optional<CameraModel> camera;
  if (!options.configuration.empty()) {
    if (const auto lens = lens_of(recorded, configuration)) camera = *lens;
  }
  return board_guide(*wish, camera, least_s);
}

LiveRecording::~LiveRecording() {
  std::error_code ignored;
  if (!kept_) std::filesystem::remove(file_, ignored);
}

SetupExpected<LiveRecording> record_live(const LiveOptions& options, const std::string& tool, LiveGuide& guide,
                                         const Console& console) {
  const SavedSignalMask as_before;  // what is measured after this may be interrupted
  auto stop = StopSignal::install();
  if (!stop) return tl::unexpected(stop.error());
  auto configuration = load_configuration(options.configuration, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return wrong_setup(configuration.error());
  if (options.unregistered) {
    const TrackerConfiguration untold;
    std::copy_n(untold.translation_IW_mm, 3, configuration->tracker.translation_IW_mm);
    std::copy_n(untold.rotation_IW_wxyz, 4, configuration->tracker.rotation_IW_wxyz);
  }
  auto devices = named_devices(*configuration, options.configuration);
  if (!devices) return wrong_setup(told_in(options.configuration, devices.error()));
  if (!devices->tracker && !devices->camera) {
    return wrong_setup(options.configuration +
                       ": names neither a camera nor a tracker; perimap setup writes one that does");
  }
  const std::vector<std::string> names = tracked_tool_names(configuration->tracker);
  if (tool != kScopeTool && std::find(names.begin(), names.end(), tool) == names.end()) {
    return wrong_setup(
        fmt::format("{}: names no tool '{}' beside the sensor: name it as tracker.pointer or in "
                    "tracker.instruments",
                    options.configuration, tool));
  }
  const auto file = recording_file(options);
  if (!file) return tl::unexpected(file.error());
  auto recorder = SessionRecorder::create(
      *file, recording_facts(*configuration, std::nullopt, "perimap calibrate " PERIMAP_VERSION),
      static_cast<std::size_t>(configuration->recording.memory_MB) << 20U);
  if (!recorder) return tl::unexpected(recorder.error());
  LiveRecording recording(*file, !options.keep.empty());

  Shown shown;
  Interrupt interrupt;
  DeviceHealth camera_health;
  DeviceHealth tracker_health;
  ThreadLauncher launcher({});
  (*recorder)->start(launcher);
  std::vector<std::jthread> threads;
  std::unique_ptr<ReplayFeeder> playback;
  if (auto* played = devices->camera ? std::get_if<CameraPlayback>(&*devices->camera) : nullptr) {
    const SensorIntake intake{nullptr, recorder->get(), &shown};
    playback = std::make_unique<ReplayFeeder>(std::move(played->reader), intake, played->offset);
    playback->start(launcher);
  } else if (devices->camera) {
    threads.emplace_back([&] {
      const CameraSink sink = [&](const CameraFrame& frame) {
        (*recorder)->frame(frame);
        shown.frame(frame);
      };
      // What goes wrong is in its health, and told below.
      static_cast<void>(serve_camera(*devices->camera, sink, camera_health, interrupt));
    });
  }
  if (devices->tracker) {
    threads.emplace_back([&] {
      const TrackerSink sink = [&](const TrackerSample& sample) {
        (*recorder)->pose(sample);
        if (tool == kScopeTool) shown.pose(sample);
      };
      const ToolSink tools = [&](const ToolSample& sample) {
        (*recorder)->tool(sample);
        if (sample.tool < names.size() && names[sample.tool] == tool) shown.pose(sample);
      };
      serve_tracker(*devices->tracker, sink, tools, tracker_health, interrupt);
    });
  }
  const Instant begin = MonotonicClock::now();
  constexpr Duration kTick = std::chrono::milliseconds(200);
  {
    Lines lines(console);
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
      lines.show(elapsed_s, line);
      if (stopped || guide.enough() || elapsed_s >= options.longest_s || (*recorder)->summary().stopped) break;
    }
  }
  interrupt.request();
  threads.clear();
  if (playback) playback->stop();
  (*recorder)->stop();
  if (playback && playback->error()) return fail(playback->error()->message);
  if ((*recorder)->summary().stopped) return fail((*recorder)->reason());
  if ((*recorder)->summary().recorded == 0) {
    return fail(fmt::format("no device gave anything: perimap probe {} says why", options.configuration));
  }
  if (!guide.enough()) console.complain("ended before there was enough of everything: " + guide.line());
  return recording;
}

Outcome with_recording(const LiveOptions& options, const std::string& tool, LiveGuide& guide, const Console& console,
                       std::string& recording, const std::function<Outcome()>& measure) {
  if (options.configuration.empty()) return measure();
  if (!recording.empty()) return refuse("--live and --from: expected one of them", ExitCode::kWrongUsage);
  const auto recorded = record_live(options, tool, guide, console);
  if (!recorded) return refuse(recorded.error());
  recording = recorded->file();
  Outcome measured = measure();
  if (!measured && options.keep.empty()) {
    std::string& told = measured.error().error.message;
    for (auto at = told.find(recording); at != std::string::npos; at = told.find(recording)) {
      told.replace(at, recording.size(), options.configuration);
    }
  }
  return measured;
}

}  // namespace perimap
