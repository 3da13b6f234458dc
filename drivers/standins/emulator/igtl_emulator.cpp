#include "drivers/standins/emulator/igtl_emulator.hpp"

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

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

// The server's own clock began with the track, at 1 s; 0 would be no stamp.
std::uint64_t IgtlEmulator::stamp_of(Duration since) const noexcept {
  using Stamps = IgtlEmulatorSettings::Stamps;
  constexpr double kUnit = 4294967296.0;
  const double t_s = 1.0 + to_seconds(since) * settings_.clock_rate;
  const double whole_s = std::floor(t_s);
  const auto fixed = [](double seconds) { return static_cast<std::uint64_t>(std::llround(seconds * kUnit)); };
  switch (settings_.stamps) {
    case Stamps::kSeconds:
      break;
    case Stamps::kMilliseconds:
      return fixed(std::floor(t_s * 1e3));
    case Stamps::kMicroseconds:
      return static_cast<std::uint64_t>(std::llround(t_s * 1e6)) << 32U;
    case Stamps::kWholeSeconds:
      return fixed(whole_s);
    case Stamps::kNanosecondFraction:
      return fixed(whole_s) + static_cast<std::uint64_t>(std::llround((t_s - whole_s) * 1e9));
    case Stamps::kCounts:
      return static_cast<std::uint64_t>(next_ + 1) << 32U;
    case Stamps::kNone:
      return 0;
  }
  return fixed(t_s);
}

void IgtlEmulator::send(LinkControl& link, const std::string& name, std::uint64_t stamp, const ToolReading& reading) {
  const bool seen = reading.state == ToolState::kOk;
  if (!seen && settings_.version == 1) return;
  const bool transform = settings_.message == IgtlEmulatorSettings::Message::kTransform;
  IgtlMessage message;
  message.version = settings_.version;
  message.device = name;
  message.time_stamp = stamp;
  message.type = transform ? "TRANSFORM" : "POSITION";
  message.content = transform ? encode_igtl_transform(reading.X_TO) : encode_igtl_position(reading.X_TO);
  if (settings_.version == 2) message.metadata = {{"TransformStatus", seen ? "OK" : "MISSING"}};
  sender_.send(link, encode_igtl(message), kLastCrcByte);
}

void IgtlEmulator::on_time(LinkControl& link, Instant now) {
  for (; next_ < track_.size() && due(next_) <= now; ++next_) {
    const Duration since = track_.since_start(next_);
    const std::uint64_t stamp = stamp_of(since);
    std::vector<std::pair<std::string, ToolReading>> readings{{settings_.tool, track_.reading(next_)}};
    for (const auto& [name, track] : settings_.others) {
      const ToolReading there = track.at(track_.start() + since - track.start());
      if (name == settings_.tool) {
        readings.front().second = there;
      } else {
        readings.emplace_back(name, there);
      }
    }
    if (faults_.missing(since)) readings.front().second = {};
    if (settings_.message != IgtlEmulatorSettings::Message::kTdata) {
      for (const auto& [name, reading] : readings) send(link, name, stamp, reading);
      continue;
    }
    std::vector<IgtlTool> tools;
    for (const auto& [name, reading] : readings) {
      if (reading.state == ToolState::kOk) tools.push_back({name, reading.X_TO});
    }
    IgtlMessage message{settings_.version, "TDATA", settings_.tool, stamp, encode_igtl_tdata(tools), {}};
    sender_.send(link, encode_igtl(message), kLastCrcByte);
  }
}

}  // namespace perimap
