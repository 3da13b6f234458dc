// Medlab EG01010, protocol 1: "EG01010 User Manual" version 1.06, Medlab medizinische Diagnosegeraete GmbH, pages
// 12-14.
//
// 9600 8N1. A token stream: bytes up to 0xF6 are data, higher ones say what follows.
//
//   F8 w w w ...   wave samples, neutral line 128, until the next marker
//   F9 r           respiration rate            FA p   pulse rate, sent at each detected beat
//   FB 11          lead off
//
//   N normal operation   S0 S1 S2  300, 100, 50 samples/s   G0 G1 G2  lead III, II, I   A0 A1 A2 amplification
//
// There is no check sum and no count: a byte that was garbled into another sample cannot be told from one, and a lost
// sample shows only as a step of the clock. Bytes before the first marker are passed over. Of respiration there is the
// rate alone, from which nobody knows where in a breath the patient is.
#pragma once

#include "drivers/ecg/ecg_protocol.hpp"

namespace perimap {

struct MedlabSettings {
  char lead = '1';         // 'G' command: 0 III, 1 II, 2 I
  double count_mV = 0.02;  // depends on the amplification; no estimate needs it
};

class MedlabProtocol final : public EcgProtocol {
 public:
  static constexpr int kBaud = 9600;
  static constexpr double kSampleRate_hz = 300.0;

  MedlabProtocol(const MedlabSettings& settings, EcgSinks sinks, DeviceHealth& health);

 protected:
  void start() override;
  void decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;

 private:
  enum class Follows : std::uint8_t { kNothing, kWave, kRespiration, kPulse, kInfo };

  MedlabSettings settings_;
  Follows follows_ = Follows::kNothing;
  bool lead_off_ = false;
};

}  // namespace perimap
