// Whether the devices of a configuration are there, and well: each is opened and listened to for a while.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/phase/breath_detector.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/time/instant.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "drivers/device/device_health.hpp"

namespace perimap {

// What a device's samples came to. Written by its thread, read after it has ended.
struct ProbedSamples {
  std::uint64_t invalid = 0;
  std::array<std::uint64_t, 4> tools{};  // by ToolState
  double largest_error_mm = 0.0;         // by the tracker's own figure; 0: it gives none
  LatencyHistogram delay;
  std::uint64_t count = 0;
  std::uint64_t first_count = 0;  // of them with the first stamp
  Instant first{}, last{};

  // `t`: of the last of these samples.
  void add(Instant t, std::uint64_t samples);
  // Of the samples' own stamps; 0 until there are some.
  [[nodiscard]] double rate_hz() const;
};

// What a respiration channel says while it is listened to.
struct ProbedBreathing {
  ProbedSamples samples;
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -std::numeric_limits<float>::infinity();
  BreathDetector detector;

  void add(const RespirationBlock& block);
};

// What came of another tool that the tracker sees.
struct ProbedTool {
  std::string name;  // as of tracked_tool_names()
  ProbedSamples seen;
};

// One device, after it was listened to.
struct ProbedDevice {
  const char* kind = "";  // "camera", "tracker", "ecg", "r_trigger"
  std::string where;
  DeviceHealth health;
  DeviceState state{};  // while it still ran: the end of a probe closes the devices
  ProbedSamples seen;
  int respiration_channel = 0;  // of an ECG device; 0: none
  ProbedBreathing breathing;
  std::deque<ProbedTool> tools;  // of a tracker, by ToolSample::tool; without a name: not asked for
};

using ProbedDevices = std::vector<std::unique_ptr<ProbedDevice>>;

// Listens to them all at once, for so long or until a signal comes. `configuration`: that names `devices`.
[[nodiscard]] ProbedDevices probe_devices(const Configuration& configuration, const Devices& devices, Duration listened,
                                          StopSignal& stop);

}  // namespace perimap
