// OpenBCI Cyton: "Cyton Data Format" and "Cyton Board SDK" in OpenBCI's public documentation.
//
// 115200 8N1. `v` resets the board, which answers with a text that ends in "$$$"; `b` starts, `s` stops. 250 packets/s:
//
//   A0 n aaa aaa aaa aaa aaa aaa aaa aaa xxxxxx Cn    n: count modulo 256; a: 24-bit two's complement, big-endian, of
//                                                     channels 1 to 8; x: accelerometer or clock; C0 to C6 closes
//
// A board may greet seconds after it was asked, so after three questions it is waited for: 5 s, at the next openings of
// the port 8 and 14 s, then 5 s again. One that has greeted may have missed its `b`: it is told again every half second
// until samples come. A dongle that reaches no board says so, "Failure: ...$$$", which is no greeting.
//
// With a Daisy module packets are of the two boards in turn; its greeting names it, and it is refused by that name.
//
// There is no check sum, so shape and count stand for it: synchronisation needs three packets in a row, and a packet
// whose number does not follow counts only when the next agrees with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/ecg/counted_framer.hpp"
#include "drivers/ecg/ecg_protocol.hpp"
#include "drivers/ecg/rail_watch.hpp"

namespace perimap {

struct CytonSettings {
  int channel = 1;              // 1 to 8
  int second_channel = 0;       // 1 to 8, another: a second lead of the ECG; 0: none
  int respiration_channel = 0;  // 1 to 8, another; 0: none
  double gain = 24.0;           // of the board's amplifier
};

class CytonProtocol final : public EcgProtocol {
 public:
  static constexpr int kBaud = 115200;
  static constexpr double kSampleRate_hz = 250.0;
  static constexpr std::size_t kPacketBytes = 33;
  static constexpr int kChannels = 8;

  CytonProtocol(const CytonSettings& settings, EcgSinks sinks, DeviceHealth& health);

 protected:
  void start() override;
  void decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;
  [[nodiscard]] std::string why_no_sample(std::uint64_t bytes, double seconds) const override;

 private:
  // From the last question on; what comes to 2 s more gives the port up.
  static constexpr Duration kPatience = std::chrono::seconds(3);
  static constexpr Duration kLongestPatience = std::chrono::seconds(12);

  void await_greeting(LinkControl& link, std::span<const std::byte> bytes);
  void begin(const std::string& name);
  void refuse_daisy(LinkControl& link, const std::string& greeting);
  void answers(std::string awaited);

  CytonSettings settings_;
  bool prompted_ = false;
  bool no_board_ = false;          // says the dongle, since the port was opened
  bool streams_ = false;           // before it was told to
  Duration patience_ = kPatience;  // with the greeting, at the next opening
  std::string heard_;              // since the last prompt
  CountedFramer framer_;
  RailWatch lead_{kSampleRate_hz, RailWatch::kLeadOff_s};
  RailWatch second_lead_{kSampleRate_hz, RailWatch::kLeadOff_s};
  RailWatch breath_sensor_{kSampleRate_hz, RailWatch::kSensorOff_s};
};

}  // namespace perimap
