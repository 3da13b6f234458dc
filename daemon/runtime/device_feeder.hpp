// The threads that read the devices, each pushing into the pipeline's entrance.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/runtime/device_news.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/ecg/ecg_assembler.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// Reads the device on the calling thread until interrupted; reopens it when it fails.
void serve_tracker(const TrackerDevice& device, const TrackerSink& sink, const ToolSink& tools, DeviceHealth& health,
                   const Interrupt& interrupt);
void serve_ecg(const EcgDevice& device, const EcgSinks& sinks, DeviceHealth& health, const Interrupt& interrupt);
void serve_r_trigger(const RTriggerDevice& device, const RTriggerSink& sink, DeviceHealth& health,
                     const Interrupt& interrupt);

// The frames come as the camera gives them. Not for a playback. Returns when a video has ended, too; otherwise an error
// says why it could not be read.
[[nodiscard]] Expected<void> serve_camera(const CameraDevice& device, const CameraSink& sink, DeviceHealth& health,
                                          const Interrupt& interrupt);

// A recording that may be asked for.
struct DeviceRecording {
  // Null: what the devices give is not to be recorded at all.
  std::unique_ptr<SessionRecorder> recorder;
  // Where the next one goes, and what it says of itself. Without it none can be begun at run time.
  struct Next {
    std::filesystem::path file;
    SensorRecordingFacts facts;
  };
  std::function<Next()> next;
};

// Tells in the log whenever a device comes, goes, falls silent or has something to say of itself, and why (of one that
// does all the time, now and then: DeviceNews), and when the recording stops. Ends when the camera's playback or video
// ends.
class DeviceFeeder final : public SensorFeeder {
 public:
  // `entrance`: none to record alone.
  DeviceFeeder(Devices devices, SensorEntrance* entrance, DeviceRecording recording);
  DeviceFeeder(const DeviceFeeder&) = delete;
  DeviceFeeder& operator=(const DeviceFeeder&) = delete;
  ~DeviceFeeder() override { stop(); }

  void give_tools_to(ToolTeller* tools) override;
  void start(ThreadLauncher& threads) override;
  void stop() override;
  void tick() override;
  void describe(StatusFacts& facts) const override;
  [[nodiscard]] Expected<std::string> record(bool on) override;

  [[nodiscard]] bool ended() const noexcept override;
  [[nodiscard]] const std::optional<Error>& error() const noexcept override;
  [[nodiscard]] std::vector<Error> damage() const override;

  // Null when nothing is recorded.
  [[nodiscard]] const SessionRecorder* recorder() const noexcept { return recording_.recorder.get(); }

 private:
  void run_camera(const CameraDevice& device);
  void tell_recording();
  static void tell(const DeviceHealth& health, DeviceNews& news);

  Devices devices_;
  DeviceRecording recording_;
  SensorIntake intake_;
  std::unique_ptr<ReplayFeeder> playback_;
  DeviceHealth tracker_health_;
  DeviceHealth ecg_health_;
  DeviceHealth r_trigger_health_;
  DeviceHealth camera_health_;
  DeviceNews tracker_news_{"tracker"};
  DeviceNews ecg_news_{"ECG"};
  DeviceNews r_trigger_news_{"R trigger"};
  DeviceNews camera_news_{"camera"};
  bool recording_ended_ = false;
  std::uint64_t recording_told_ = 0;  // the count of the file that was told of last
  bool recording_stop_told_ = false;
  std::uint64_t not_recorded_told_ = 0;
  std::optional<Error> camera_error_;
  // Release by the camera's thread when its video has ended, acquire in ended(): camera_error_ is then visible.
  std::atomic<bool> camera_ended_{false};
  Interrupt interrupt_;
  std::vector<std::thread> threads_;
};

}  // namespace perimap
