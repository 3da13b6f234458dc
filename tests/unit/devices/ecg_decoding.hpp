// What tests of ECG protocols have in common.
#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <map>
#include <numeric>
#include <random>
#include <regex>

#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/ecg/cyton.hpp"
#include "drivers/ecg/medlab.hpp"
#include "scripted_link.hpp"

namespace perimap {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

inline std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

// What the protocol sends by its own clock, each with its instant since the start.
inline std::vector<std::pair<Duration, std::string>> commands_until(EcgProtocol& protocol, ScriptedLink& link,
                                                                    Instant end) {
  std::vector<std::pair<Duration, std::string>> commands;
  (void)link.take_sent();
  for (Instant t = protocol.next_time(); t < end && link.failure.empty(); t = protocol.next_time()) {
    protocol.on_time(link, t);
    commands.emplace_back(t - kStart, link.take_sent());
  }
  return commands;
}

struct Received {
  std::vector<EcgBlock> blocks;
  std::vector<RespirationBlock> breaths;
  DeviceHealth health;
  EcgSinks sink() {
    return {[this](const EcgBlock& block) { blocks.push_back(block); },
            [this](const RespirationBlock& block) { breaths.push_back(block); }};
  }
  // Of all samples, in order: whole counts of the converter.
  std::vector<int> counts(double count_mV) const {
    std::vector<int> all;
    for (const EcgBlock& block : blocks) {
      for (const float mV : block.samples()) all.push_back(static_cast<int>(std::lround(mV / count_mV)));
    }
    return all;
  }
};

// ---- BITalino and Cyton: frames with a count

inline std::vector<std::byte> bitalino_frame(unsigned sequence, unsigned value) {
  auto frame = bytes_of(
      {static_cast<int>(value << 2U & 0xFFU), static_cast<int>(value >> 6U), static_cast<int>(sequence % 16 << 4U)});
  frame[2] |= static_cast<std::byte>(bitalino_crc(frame));
  return frame;
}

// As a board with two inputs taken sends it; `low` is of the one with the lower number.
inline std::vector<std::byte> bitalino_frame_of_two(unsigned sequence, unsigned low, unsigned high) {
  auto frame = bytes_of({static_cast<int>(high & 0xFFU), static_cast<int>((low << 2U | high >> 8U) & 0xFFU),
                         static_cast<int>(low >> 6U), static_cast<int>(sequence % 16 << 4U)});
  frame[3] |= static_cast<std::byte>(bitalino_crc(frame));
  return frame;
}

// With three inputs taken, in order of their numbers.
inline std::vector<std::byte> bitalino_frame_of_three(unsigned sequence, std::array<unsigned, 3> values) {
  const auto [low, middle, high] = values;
  auto frame = bytes_of({static_cast<int>(high << 6U & 0xFFU), static_cast<int>(high >> 2U),
                         static_cast<int>(middle & 0xFFU), static_cast<int>((low << 2U | middle >> 8U) & 0xFFU),
                         static_cast<int>(low >> 6U), static_cast<int>(sequence % 16 << 4U)});
  frame[5] |= static_cast<std::byte>(bitalino_crc(frame));
  return frame;
}

inline std::vector<std::byte> cyton_packet(unsigned count, int value, int channel_5 = 0) {
  std::vector<std::byte> packet(CytonProtocol::kPacketBytes);
  packet[0] = std::byte{0xA0};
  packet[1] = static_cast<std::byte>(count % 256);
  for (unsigned i = 0; i < 3; ++i) {
    packet[2 + i] = static_cast<std::byte>(static_cast<unsigned>(value) >> (16U - 8U * i) & 0xFFU);
    packet[14 + i] = static_cast<std::byte>(static_cast<unsigned>(channel_5) >> (16U - 8U * i) & 0xFFU);
  }
  packet[32] = std::byte{0xC0};
  return packet;
}

// The board answers the host's first question.
inline void open_cyton(EcgProtocol& protocol, ScriptedLink& link) {
  protocol.on_open(link, kStart);
  const std::string_view greeting = "OpenBCI V3\n$$$";
  protocol.on_bytes(link, std::as_bytes(std::span(greeting.data(), greeting.size())), kStart);
}

inline void append(std::vector<std::byte>& to, const std::vector<std::byte>& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

}  // namespace perimap
