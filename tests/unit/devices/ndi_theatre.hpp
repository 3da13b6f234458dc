// What tests of NDI trackers have in common.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>

#include "drivers/standins/emulator/ndi_emulator.hpp"
#include "drivers/tracker/ndi_session.hpp"
#include "scripted_link.hpp"

namespace perimap {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

inline std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

inline const PoseTrack& track() {
  static const PoseTrack swaying = PoseTrack::swaying(kStart, 100.0);
  return swaying;
}

inline Pose swaying_at(std::uint32_t frame) { return track().at(frame).X_TO; }

// Session and emulated device, connected without a transport; time is made.
struct Theatre {
  Theatre(NdiSettings settings, const NdiEmulatorSettings& device_settings, bool serial = false,
          const EmulatorFaults& faults = {}, int baud = 0, const PoseTrack& poses = track())
      : far(serial, baud),
        device(poses, device_settings, faults),
        session(
            std::move(settings), [this](const TrackerSample& sample) { samples.push_back(sample); }, health,
            [this](const ToolSample& sample) { tools.push_back(sample); }),
        host(serial, baud) {
    device.on_open(far, now);
    session.on_open(host, now);
  }

  // One millisecond a round.
  void run(Duration longest) {
    for (const Instant end = now + longest; now < end && host.failure.empty(); now += milliseconds(1)) {
      const auto to_device = bytes_of(host.take_sent());
      sent.append(reinterpret_cast<const char*>(to_device.data()), to_device.size());
      if (far.baud() != host.baud()) far.set_line_rate(host.baud());  // both ends of one line
      device.on_bytes(far, to_device, now);
      device.on_time(far, now);
      const auto to_host = bytes_of(far.take_sent());
      if (!to_host.empty()) session.on_bytes(host, to_host, now);
      if (now >= session.next_time()) session.on_time(host, now);
    }
  }

  Instant now = kStart;
  std::vector<TrackerSample> samples;
  std::vector<ToolSample> tools;
  std::string sent;
  DeviceHealth health;
  ScriptedLink far;
  NdiEmulator device;
  NdiSession session;
  ScriptedLink host;
};

inline NdiSettings wired() {
  NdiSettings settings;
  settings.frame_rate_hz = 100.0;
  return settings;
}

}  // namespace perimap
