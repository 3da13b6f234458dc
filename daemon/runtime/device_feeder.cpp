#include "daemon/runtime/device_feeder.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "daemon/runtime/privileges.hpp"
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

SerialEcg serial_ecg(const EcgConfiguration& c, EcgSink sink, DeviceHealth& health) {
  using Protocol = EcgConfiguration::Protocol;
  if (c.protocol == Protocol::kBitalino) {
    BitalinoSettings settings;
    if (c.channel > 0) settings.channel = c.channel;
    return {std::make_unique<BitalinoProtocol>(settings, std::move(sink), health), BitalinoProtocol::kBaud};
  }
  if (c.protocol == Protocol::kCyton) {
    CytonSettings settings;
    if (c.channel > 0) settings.channel = c.channel;
    return {std::make_unique<CytonProtocol>(settings, std::move(sink), health), CytonProtocol::kBaud};
  }
  MedlabSettings settings;
  if (c.count_mV > 0.0) settings.count_mV = c.count_mV;
  return {std::make_unique<MedlabProtocol>(settings, std::move(sink), health), MedlabProtocol::kBaud};
}

}  // namespace

void serve_tracker(const TrackerDevice& device, const TrackerSink& sink, DeviceHealth& health,
                   const Interrupt& interrupt) {
  const StreamOpener open = opener_of(device.endpoint, NdiSettings::kFirstBaud);
  if (const auto* ndi = std::get_if<NdiSettings>(&device.settings)) {
    NdiSession session(*ndi, sink, health);
    serve_device(open, session, health, interrupt);
  } else {
    IgtlSession session(std::get<IgtlSettings>(device.settings), sink, health);
    serve_device(open, session, health, interrupt);
  }
}

void serve_ecg(const EcgDevice& device, const EcgSink& sink, DeviceHealth& health, const Interrupt& interrupt) {
  const EcgConfiguration& c = device.settings;
  if (const auto* can = std::get_if<CanEndpoint>(&device.endpoint)) {
    CanEcgSettings settings;
    settings.identifier = static_cast<std::uint32_t>(c.can_identifier);
    settings.extended = c.can_extended;
    settings.sample_rate_hz = c.can_sample_rate_hz;
    if (c.count_mV > 0.0) settings.count_mV = c.count_mV;
    serve_can_ecg(can->interface_name, settings, sink, health, interrupt);
    return;
  }
  const SerialEcg ecg = serial_ecg(c, sink, health);
  serve_device(opener_of(device.endpoint, ecg.baud), *ecg.protocol, health, interrupt);
}

DeviceFeeder::DeviceFeeder(TrackerDevice tracker, EcgDevice ecg, CameraPlayback camera, SensorEntrance& entrance,
                           int priority)
    : tracker_(std::move(tracker)),
      ecg_(std::move(ecg)),
      entrance_(entrance),
      priority_(priority),
      camera_(std::move(camera.reader), entrance, priority, camera.offset) {}

void DeviceFeeder::start() {
  threads_.emplace_back([this] {
    static_cast<void>(apply({"tracker", priority_, {}}));
    serve_tracker(
        tracker_, [this](const TrackerSample& sample) { entrance_.push_pose(sample); }, tracker_health_, interrupt_);
  });
  threads_.emplace_back([this] {
    static_cast<void>(apply({"ecg", priority_, {}}));
    serve_ecg(
        ecg_, [this](const EcgBlock& block) { entrance_.push_ecg(block); }, ecg_health_, interrupt_);
  });
  camera_.start();
}

void DeviceFeeder::stop() {
  interrupt_.request();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  camera_.stop();
}

void DeviceFeeder::tell(const char* name, const DeviceHealth& health, Told& told) {
  const DeviceState state = health.state();
  std::string reason = health.reason();
  if (state == told.state && (reason == told.reason || state != DeviceState::kClosed)) return;
  told.state = state;
  told.reason = reason;
  if (state == DeviceState::kStreaming) {
    const std::string identity = health.identity();
    spdlog::info("{}: streaming{}{}", name, identity.empty() ? "" : ": ", identity);
  } else if (state == DeviceState::kClosed) {
    spdlog::warn("{}: {}", name, reason.empty() ? "closed" : reason);
  } else {
    spdlog::info("{}: {}", name, device_state_name(state));
  }
}

void DeviceFeeder::describe(StatusFacts& facts) const {
  const auto link = [](const DeviceHealth& health) {
    const LatencyHistogram::Summary jitter = health.jitter.summary();
    return SourceLink{health.state() == DeviceState::kClosed, jitter.p50, jitter.p99};
  };
  facts.tracker = link(tracker_health_);
  facts.ecg = link(ecg_health_);
}

void DeviceFeeder::tick() {
  tell("tracker", tracker_health_, tracker_told_);
  tell("ECG", ecg_health_, ecg_told_);
}

}  // namespace perimap
