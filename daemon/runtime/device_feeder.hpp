// The threads that read the devices, each pushing into the pipeline's entrance.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/sensor_feeder.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/device/device_protocol.hpp"
#include "drivers/ecg/ecg_assembler.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// Reads the device on the calling thread until interrupted; reopens it when it fails.
void serve_tracker(const TrackerDevice& device, const TrackerSink& sink, DeviceHealth& health,
                   const Interrupt& interrupt);
void serve_ecg(const EcgDevice& device, const EcgSink& sink, DeviceHealth& health, const Interrupt& interrupt);

// Tells in the log whenever a device comes, goes or falls silent, and why. Ends when the camera's playback ends.
class DeviceFeeder final : public SensorFeeder {
 public:
  DeviceFeeder(TrackerDevice tracker, EcgDevice ecg, CameraPlayback camera, SensorEntrance& entrance, int priority);
  DeviceFeeder(const DeviceFeeder&) = delete;
  DeviceFeeder& operator=(const DeviceFeeder&) = delete;
  ~DeviceFeeder() override { stop(); }

  void start() override;
  void stop() override;
  void tick() override;
  void describe(StatusFacts& facts) const override;

  [[nodiscard]] bool ended() const noexcept override { return camera_.ended(); }
  [[nodiscard]] const std::optional<Error>& error() const noexcept override { return camera_.error(); }
  [[nodiscard]] std::vector<Error> damage() const override { return camera_.damage(); }

 private:
  struct Told {
    DeviceState state = DeviceState::kClosed;
    std::string reason;
  };
  static void tell(const char* name, const DeviceHealth& health, Told& told);

  TrackerDevice tracker_;
  EcgDevice ecg_;
  SensorEntrance& entrance_;
  int priority_;
  ReplayFeeder camera_;
  DeviceHealth tracker_health_;
  DeviceHealth ecg_health_;
  Told tracker_told_;
  Told ecg_told_;
  Interrupt interrupt_;
  std::vector<std::thread> threads_;
};

}  // namespace perimap
