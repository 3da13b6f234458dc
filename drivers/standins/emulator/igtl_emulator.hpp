// An emulated OpenIGTLink tracker server: the far end of drivers/tracker/igtl_session.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/device/device_protocol.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/standins/emulator/pose_track.hpp"

namespace perimap {

struct IgtlEmulatorSettings {
  enum class Message : std::uint8_t { kTransform, kTdata, kPosition };

  Message message = Message::kTransform;
  unsigned version = 1;  // of the header; 2 tells a missing tool in its metadata
  std::string tool = "Scope";
  std::vector<std::pair<std::string, PoseTrack>> others = {};  // names and places of further tools, or of this one

  // What it stamps with; OpenIGTLink means seconds of the sender's clock.
  enum class Stamps : std::uint8_t {
    kSeconds,
    kMilliseconds,        // where the seconds belong
    kMicroseconds,        // likewise
    kWholeSeconds,        // without their fraction
    kNanosecondFraction,  // a fraction in ns, where 2^-32 s are meant
    kCounts,              // of the messages
    kNone
  };
  Stamps stamps = Stamps::kSeconds;
  double clock_rate = 1.0;  // seconds of its clock in one of ours
};

// Sends a message at each reading of the track, and of each other tool's place then, from the connection on. Where a
// message cannot say that the tool is missing (TRANSFORM and POSITION of version 1), it is not sent.
class IgtlEmulator final : public DeviceProtocol {
 public:
  IgtlEmulator(PoseTrack track, IgtlEmulatorSettings settings, const EmulatorFaults& faults);

  void on_open(LinkControl& link, Instant now) override;
  void on_bytes(LinkControl& /*link*/, std::span<const std::byte> /*bytes*/, Instant /*arrival*/) override {}
  void on_time(LinkControl& link, Instant now) override;
  [[nodiscard]] Instant next_time() const noexcept override { return due(next_); }

 private:
  [[nodiscard]] std::uint64_t stamp_of(Duration since) const noexcept;
  void send(LinkControl& link, const std::string& name, std::uint64_t stamp, const ToolReading& reading);
  [[nodiscard]] Instant due(std::size_t reading) const noexcept;

  PoseTrack track_;
  IgtlEmulatorSettings settings_;
  EmulatorFaults faults_;
  FaultySender sender_;
  std::size_t next_ = 0;
};

}  // namespace perimap
