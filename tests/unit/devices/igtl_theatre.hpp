// Session and emulated OpenIGTLink server, connected without a transport; time is made.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "igtl_messages.hpp"

namespace perimap {

struct IgtlTheatre {
  IgtlTheatre(IgtlSettings settings, IgtlEmulatorSettings device_settings, const EmulatorFaults& faults = {})
      : device(track(), std::move(device_settings), faults),
        session(
            std::move(settings), [this](const TrackerSample& sample) { samples.push_back(sample); }, health,
            [this](const ToolSample& sample) { tools.push_back(sample); }) {
    device.on_open(far, now);
    session.on_open(host, now);
  }
  static const PoseTrack& track() {
    static const PoseTrack swaying = PoseTrack::swaying(kStart, 50.0);
    return swaying;
  }
  void run(Duration longest) {
    for (const Instant end = now + longest; now < end && host.failure.empty(); now += milliseconds(1)) {
      if (now >= device.next_time()) device.on_time(far, now);
      const std::string sent = far.take_sent();
      if (!sent.empty()) session.on_bytes(host, std::as_bytes(std::span(sent.data(), sent.size())), now);
      if (now >= session.next_time()) session.on_time(host, now);
    }
  }

  Instant now = kStart;
  std::vector<TrackerSample> samples;
  std::vector<ToolSample> tools;
  DeviceHealth health;
  ScriptedLink far;
  IgtlEmulator device;
  ScriptedLink host;
  IgtlSession session;
};

}  // namespace perimap
