#include "drivers/standins/emulator/igtl_emulator.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "drivers/tracker/igtl_message.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLastCrcByte = 57;
constexpr Duration kOldest = std::chrono::milliseconds(50);  // reading that a new connection is given

}  // namespace

IgtlEmulator::IgtlEmulator(PoseTrack track, IgtlEmulatorSettings settings, const EmulatorFaults& faults)
    : track_(std::move(track)), settings_(std::move(settings)), faults_(faults), sender_(faults) {}

Instant IgtlEmulator::due(std::size_t reading) const noexcept {
  if (reading >= track_.size()) return kNever;
  const auto since_ns = static_cast<double>(track_.since_start(reading).count());
  return track_.start() + Duration(std::llround(since_ns / (1.0 + 1e-6 * faults_.drift_ppm)));
}

// A client that comes after the recording, or within one of its gaps, is not given what was before.
void IgtlEmulator::on_open(LinkControl& /*link*/, Instant now) {
  next_ = track_.index_at(now - track_.start());
  if (next_ < track_.size() && now - due(next_) > kOldest) ++next_;
}

void IgtlEmulator::on_time(LinkControl& link, Instant now) {
  using Message = IgtlEmulatorSettings::Message;
  for (; next_ < track_.size() && due(next_) <= now; ++next_) {
    const Duration since = track_.since_start(next_);
    const ToolReading reading = faults_.missing(since) ? ToolReading{} : track_.reading(next_);
    const bool seen = reading.state == ToolState::kOk;
    IgtlMessage message;
    message.version = settings_.version;
    message.device = settings_.tool;
    // The server's own clock began with the track; 0 would be no stamp.
    const Duration stamp = since + std::chrono::seconds(1);
    message.time_stamp = static_cast<std::uint64_t>(std::llround(to_seconds(stamp) * 4294967296.0));
    if (settings_.message == Message::kTdata) {
      const std::array<IgtlTool, 1> tools{IgtlTool{settings_.tool, reading.X_TO}};
      message.type = "TDATA";
      message.content = encode_igtl_tdata(std::span(tools).first(seen ? 1 : 0));
    } else {
      if (!seen && settings_.version == 1) continue;
      const bool transform = settings_.message == Message::kTransform;
      message.type = transform ? "TRANSFORM" : "POSITION";
      message.content = transform ? encode_igtl_transform(reading.X_TO) : encode_igtl_position(reading.X_TO);
      if (settings_.version == 2) message.metadata = {{"TransformStatus", seen ? "OK" : "MISSING"}};
    }
    sender_.send(link, encode_igtl(message), kLastCrcByte);
  }
}

}  // namespace perimap
