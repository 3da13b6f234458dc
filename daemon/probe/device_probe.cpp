#include "daemon/probe/device_probe.hpp"

#include <algorithm>
#include <functional>
#include <thread>
#include <utility>

#include "core/pipeline/hear_breath.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/transport/endpoint.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {
namespace {

void listen_to(const TrackerDevice& device, ProbedDevice& probed, const Interrupt& interrupt) {
  const auto add = [](const TrackerSample& sample, ProbedSamples& seen) {
    seen.add(sample.source_time, 1);
    seen.delay.add(sample.arrival - sample.source_time);
    ++seen.tools[static_cast<std::size_t>(sample.state)];
    if (sample.state != ToolState::kOk) ++seen.invalid;
    seen.largest_error_mm = std::max(seen.largest_error_mm, sample.error_mm);
  };
  const TrackerSink sensor = [&](const TrackerSample& sample) { add(sample, probed.seen); };
  const ToolSink others = [&](const ToolSample& sample) { add(sample, probed.tools.at(sample.tool).seen); };
  serve_tracker(device, sensor, others, probed.health, interrupt);
}

void listen_to(const EcgDevice& device, ProbedDevice& probed, const Interrupt& interrupt) {
  const EcgSink ecg = [&seen = probed.seen](const EcgBlock& block) {
    seen.add(block.last_sample_time(), block.count);
    seen.delay.add(block.arrival - block.last_sample_time());
    if (block.lead_off) seen.invalid += block.count;
  };
  const RespirationSink respiration = [&probed](const RespirationBlock& block) { probed.breathing.add(block); };
  serve_ecg(device, {ecg, respiration}, probed.health, interrupt);
}

void listen_to(const RTriggerDevice& device, ProbedDevice& probed, const Interrupt& interrupt) {
  const RTriggerSink sink = [&seen = probed.seen](const RTriggerPulse& pulse) {
    seen.add(pulse.time, 1);
    seen.delay.add(pulse.arrival - pulse.time);
  };
  serve_r_trigger(device, sink, probed.health, interrupt);
}

void listen_to(const CameraDevice& device, ProbedDevice& probed, const Interrupt& interrupt) {
  GreyConverter converter;
  const CameraSink sink = [&seen = probed.seen, &converter](const CameraFrame& frame) {
    seen.add(frame.stamp.capture, 1);
    seen.delay.add(frame.stamp.arrival - frame.stamp.capture);
    if (!converter.convert(frame)) ++seen.invalid;
  };
  const auto served = serve_camera(device, sink, probed.health, interrupt);
  // A video that cannot be read says so in its health's reason.
  static_cast<void>(served);
}

}  // namespace

void ProbedSamples::add(Instant t, std::uint64_t samples) {
  if (count == 0) {
    first = t;
    first_count = samples;
  }
  last = t;
  count += samples;
}

double ProbedSamples::rate_hz() const {
  const double span_s = to_seconds(last - first);
  return span_s > 0.0 ? static_cast<double>(count - first_count) / span_s : 0.0;
}

void ProbedBreathing::add(const RespirationBlock& block) {
  samples.add(block.last_sample_time(), block.count);
  samples.delay.add(block.arrival - block.last_sample_time());
  hear_breath(block, detector);
  if (block.sensor_off) {
    samples.invalid += block.count;
    return;
  }
  for (const float value : block.samples()) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
}

ProbedDevices probe_devices(const Configuration& configuration, const Devices& devices, Duration listened,
                            StopSignal& stop) {
  ProbedDevices all;
  std::vector<std::function<void(const Interrupt&)>> listeners;
  const auto add = [&](const char* kind, std::string where, const auto& device) {
    all.push_back(std::make_unique<ProbedDevice>());
    ProbedDevice& probed = *all.back();
    probed.kind = kind;
    probed.where = std::move(where);
    listeners.emplace_back([&device, &probed](const Interrupt& interrupt) { listen_to(device, probed, interrupt); });
  };
  if (devices.camera) add("camera", *configuration.camera.device, *devices.camera);
  if (devices.tracker) {
    add("tracker", format_endpoint(devices.tracker->endpoint), *devices.tracker);
    for (const std::string& name : devices.tracker->tools) all.back()->tools.emplace_back().name = name;
  }
  if (devices.ecg) {
    add("ecg", format_endpoint(devices.ecg->endpoint), *devices.ecg);
    all.back()->respiration_channel = devices.ecg->respiration_channel;
  }
  if (devices.r_trigger) add("r_trigger", devices.r_trigger->settings.path, *devices.r_trigger);

  Interrupt interrupt;
  std::vector<std::jthread> threads;
  threads.reserve(listeners.size());
  for (const auto& listen : listeners) threads.emplace_back([&] { listen(interrupt); });
  stop.wait_for(listened);
  for (const auto& probed : all) probed->state = probed->health.state();
  interrupt.request();
  threads.clear();
  // As it was: not closed.
  for (const auto& probed : all) probed->health.set_state(probed->state);
  return all;
}

}  // namespace perimap
