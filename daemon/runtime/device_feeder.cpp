#include "daemon/runtime/device_feeder.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "daemon/config/ecg_inputs.hpp"
#include "daemon/config/tracked_tools.hpp"
#include "daemon/runtime/camera_intake.hpp"
#include "drivers/camera/v4l2_camera.hpp"
#include "drivers/device/device_link.hpp"
#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"

namespace perimap {
namespace {

struct SerialEcg {
  std::unique_ptr<EcgProtocol> protocol;
  int baud;
};

SerialEcg serial_ecg(const EcgDevice& device, EcgSinks sinks, DeviceHealth& health) {
  const EcgConfiguration& c = device.settings;
  using Protocol = EcgConfiguration::Protocol;
  if (c.protocol == Protocol::kBitalino) {
    const BitalinoSettings settings{
        .channel = ecg_input(c), .second_channel = c.second_channel, .respiration_channel = device.respiration_channel};
    return {std::make_unique<BitalinoProtocol>(settings, std::move(sinks), health), BitalinoProtocol::kBaud};
  }
  if (c.protocol == Protocol::kCyton) {
    const CytonSettings settings{
        .channel = ecg_input(c), .second_channel = c.second_channel, .respiration_channel = device.respiration_channel};
    return {std::make_unique<CytonProtocol>(settings, std::move(sinks), health), CytonProtocol::kBaud};
  }
  MedlabSettings settings;
  if (c.count_mV > 0.0) settings.count_mV = c.count_mV;
  return {std::make_unique<MedlabProtocol>(settings, std::move(sinks), health), MedlabProtocol::kBaud};
}

}  // namespace

void serve_tracker(const TrackerDevice& device, const TrackerSink& sink, const ToolSink& tools, DeviceHealth& health,
                   const Interrupt& interrupt) {
  const StreamOpener open = opener_of(device.endpoint, NdiSettings::kFirstBaud);
  if (const auto* ndi = std::get_if<NdiSettings>(&device.settings)) {
    NdiSession session(*ndi, sink, health, tools);
    serve_device(open, session, health, interrupt);
  } else {
    IgtlSession session(std::get<IgtlSettings>(device.settings), sink, health, tools);
    serve_device(open, session, health, interrupt);
  }
}

void serve_ecg(const EcgDevice& device, const EcgSinks& sinks, DeviceHealth& health, const Interrupt& interrupt) {
  const EcgConfiguration& c = device.settings;
  if (const auto* can = std::get_if<CanEndpoint>(&device.endpoint)) {
    CanEcgSettings settings;
    settings.identifier = static_cast<std::uint32_t>(c.can_identifier);
    settings.extended = c.can_extended;
    settings.sample_rate_hz = c.can_sample_rate_hz;
    if (c.count_mV > 0.0) settings.count_mV = c.count_mV;
    // Frames with respiration say so themselves; who does not want it passes it over.
    EcgSinks wanted = sinks;
    if (device.respiration_channel == 0) wanted.respiration = {};
    serve_can_ecg(can->interface_name, settings, wanted, health, interrupt);
    return;
  }
  const SerialEcg ecg = serial_ecg(device, sinks, health);
  serve_device(opener_of(device.endpoint, ecg.baud), *ecg.protocol, health, interrupt);
}

void serve_r_trigger(const RTriggerDevice& device, const RTriggerSink& sink, DeviceHealth& health,
                     const Interrupt& interrupt) {
  serve_modem_line_trigger(device.settings, sink, health, interrupt, device.open);
}

Expected<void> serve_camera(const CameraDevice& device, const CameraSink& sink, DeviceHealth& health,
                            const Interrupt& interrupt) {
  if (const auto* video = std::get_if<VideoCameraSettings>(&device)) {
    return serve_video_camera(*video, sink, health, interrupt);
  }
  serve_v4l2_camera(std::get<V4l2Settings>(device), sink, health, interrupt);
  return {};
}

DeviceFeeder::DeviceFeeder(Devices devices, SensorEntrance* entrance, DeviceRecording recording)
    : devices_(std::move(devices)), recording_(std::move(recording)), intake_{entrance, recording_.recorder.get()} {
  if (devices_.tracker) intake_.roles = roles_of(devices_.tracker->tools);
  if (!devices_.camera) return;
  if (auto* playback = std::get_if<CameraPlayback>(&*devices_.camera)) {
    playback_ = std::make_unique<ReplayFeeder>(std::move(playback->reader), intake_, playback->offset);
  }
}

// Of the tracker alone: a playback in the camera's place has frames.
void DeviceFeeder::give_tools_to(ToolTeller* tools) { intake_.tools = tools; }

void DeviceFeeder::start(ThreadLauncher& threads) {
  if (recording_.recorder) recording_.recorder->start(threads);
  if (devices_.tracker) {
    threads_.push_back(threads.launch("tracker", ThreadRole::kSource, [this] {
      const TrackerSink sink = [this](const TrackerSample& sample) { intake_.pose(sample); };
      const ToolSink tools = [this](const ToolSample& sample) { intake_.tool(sample); };
      serve_tracker(*devices_.tracker, sink, tools, tracker_health_, interrupt_);
    }));
  }
  if (devices_.ecg) {
    threads_.push_back(threads.launch("ecg", ThreadRole::kSource, [this] {
      const EcgSinks sinks([this](const EcgBlock& block) { intake_.ecg(block); },
                           [this](const RespirationBlock& block) { intake_.respiration(block); });
      serve_ecg(*devices_.ecg, sinks, ecg_health_, interrupt_);
    }));
  }
  if (devices_.r_trigger) {
    threads_.push_back(threads.launch("r-trigger", ThreadRole::kSource, [this] {
      const RTriggerSink sink = [this](const RTriggerPulse& pulse) { intake_.r_trigger(pulse); };
      serve_r_trigger(*devices_.r_trigger, sink, r_trigger_health_, interrupt_);
    }));
  }
  if (playback_) {
    playback_->start(threads);
  } else if (devices_.camera) {
    threads_.push_back(threads.launch("camera", ThreadRole::kSource, [this] { run_camera(*devices_.camera); }));
  }
}

void DeviceFeeder::run_camera(const CameraDevice& device) {
  CameraIntake camera(intake_);
  if (const auto* v4l2 = std::get_if<V4l2Settings>(&device)) camera.reserve(v4l2->width, v4l2->height);
  const CameraSink sink = [this, &camera](const CameraFrame& frame) {
    if (!camera.deliver_frame(frame)) camera_health_.damaged.add();
  };
  auto served = serve_camera(device, sink, camera_health_, interrupt_);
  if (!served) camera_error_ = std::move(served.error());
  // A camera never ends, it was interrupted.
  camera_ended_.store(!interrupt_.requested(), std::memory_order_release);
}

void DeviceFeeder::stop() {
  interrupt_.request();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  if (playback_) playback_->stop();
  if (!recording_.recorder || recording_ended_) return;
  recording_ended_ = true;
  recording_.recorder->stop();
  tell_recording();
}

bool DeviceFeeder::ended() const noexcept {
  return playback_ ? playback_->ended() : camera_ended_.load(std::memory_order_acquire);
}

const std::optional<Error>& DeviceFeeder::error() const noexcept {
  return playback_ ? playback_->error() : camera_error_;
}

std::vector<Error> DeviceFeeder::damage() const { return playback_ ? playback_->damage() : std::vector<Error>(); }

void DeviceFeeder::tell(const DeviceHealth& health, DeviceNews& news) {
  const auto line = news.next(health.state(), health.reason(), health.identity(), MonotonicClock::now());
  if (line) spdlog::log(line->warning ? spdlog::level::warn : spdlog::level::info, "{}", line->text);
  if (const auto note = news.note(health.notice())) spdlog::warn("{}", *note);
}

void DeviceFeeder::describe(StatusFacts& facts) const {
  const auto link = [](const DeviceHealth& health) {
    const LatencyHistogram::Summary jitter = health.jitter.summary();
    return SourceLink{health.state() == DeviceState::kClosed, jitter.p50, jitter.p99};
  };
  if (devices_.camera && !playback_) facts.camera = link(camera_health_);
  facts.tracker = link(tracker_health_);
  facts.ecg = link(ecg_health_);
  facts.ecg_device = devices_.ecg.has_value();
  if (devices_.ecg && devices_.ecg->respiration_channel > 0) {
    facts.respiration_channel = true;
    facts.respiration_link = facts.ecg;
  }
  if (devices_.r_trigger) facts.r_trigger_line = link(r_trigger_health_);
  if (!recording_.recorder) return;
  const SessionRecorder::Summary recorded = recording_.recorder->summary();
  if (recorded.asked) facts.recording.state = recorded.stopped ? perimap_RECORDING_STOPPED : perimap_RECORDING_ON;
  facts.recording.recorded = recorded.recorded;
  facts.recording.frames_not_recorded = recorded.frames_not_recorded;
  facts.recording.other_not_recorded = recorded.other_not_recorded;
}

Expected<std::string> DeviceFeeder::record(bool on) {
  if (!recording_.recorder || !recording_.next) return fail("nothing can be recorded");
  SessionRecorder& recorder = *recording_.recorder;
  const bool recording = recorder.summary().asked && !recorder.summary().stopped;
  if (on == recording) {
    return fail(on ? fmt::format("{}: is recorded to already", recorder.file().string()) : "nothing is recorded");
  }
  if (!on) {
    const std::string file = recorder.file().string();
    if (auto closed = recorder.close(); !closed) return tl::unexpected(std::move(closed.error()));
    spdlog::info("{}: closed, {} messages recorded since the start", file, recorder.summary().recorded);
    return fmt::format("recorded to {}\n", file);
  }
  // One that has stopped, on a full disk say, is put away first; why it did was told then.
  if (recorder.summary().files > 0 && recorder.summary().asked) static_cast<void>(recorder.close());
  const DeviceRecording::Next next = recording_.next();
  if (auto opened = recorder.open(next.file, next.facts); !opened) return tl::unexpected(std::move(opened.error()));
  spdlog::info("recording to {}", next.file.string());
  return fmt::format("recording to {}\n", next.file.string());
}

void DeviceFeeder::tick() {
  if (devices_.camera && !playback_) tell(camera_health_, camera_news_);
  if (devices_.tracker) tell(tracker_health_, tracker_news_);
  if (devices_.ecg) tell(ecg_health_, ecg_news_);
  if (devices_.r_trigger) tell(r_trigger_health_, r_trigger_news_);
  if (recording_.recorder) tell_recording();
}

void DeviceFeeder::tell_recording() {
  const SessionRecorder::Summary recorded = recording_.recorder->summary();
  if (recorded.files != recording_told_) {
    recording_told_ = recorded.files;
    recording_stop_told_ = false;
  }
  if (recorded.stopped && !recording_stop_told_) {
    recording_stop_told_ = true;
    spdlog::error("recording stopped: {}; all else goes on", recording_.recorder->reason());
  }
  const std::uint64_t lost = recorded.frames_not_recorded + recorded.other_not_recorded;
  // At the first and then when they have doubled; the topic has every one.
  if (!recorded.stopped && lost >= std::max<std::uint64_t>(1, 2 * not_recorded_told_)) {
    not_recorded_told_ = lost;
    spdlog::warn("the disk does not keep up: {} frames and {} other messages not recorded",
                 recorded.frames_not_recorded, recorded.other_not_recorded);
  }
  if (recording_ended_ && recorded.files > 0) {
    spdlog::info("recorded {} messages to {}; not recorded: {} frames, {} others", recorded.recorded,
                 recording_.recorder->file().string(), recorded.frames_not_recorded, recorded.other_not_recorded);
  }
}

}  // namespace perimap
