// The ECG protocols on bytes: good, garbled, truncated, overlong, in any chunks.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

const Instant kStart(seconds(100));

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

// What the protocol sends by its own clock, each with its instant since the start.
std::vector<std::pair<Duration, std::string>> commands_until(EcgProtocol& protocol, ScriptedLink& link, Instant end) {
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

// ---- Medlab

struct MedlabCase {
  const char* what;
  std::vector<std::byte> bytes;
  std::vector<int> counts;
  std::uint64_t damaged;
  bool lead_off_at_end;
};

TEST(Medlab, DecodesEachStreamToWhatItHolds) {
  const MedlabCase cases[] = {
      {"the manual's example",
       bytes_of({0xF8, 0x20, 0x23, 0x25, 0xFA, 0x78, 0xF8, 0x25, 0x25}),
       {-96, -93, -91, -91, -91},
       0,
       false},
      {"nothing", {}, {}, 0, false},
      {"values before the first marker", bytes_of({0x80, 0x81, 0xF8, 0x82}), {2}, 2, false},
      {"the largest and smallest value", bytes_of({0xF8, 0x00, 0xF6}), {-128, 118}, 0, false},
      {"unknown markers end the wave",
       bytes_of({0xF8, 0x81, 0xF7, 0x82, 0xFC, 0x83, 0xFF, 0xF8, 0x84}),
       {1, 4},
       5,
       false},
      {"a marker without its value", bytes_of({0xF8, 0x81, 0xFA, 0xF8, 0x82}), {1, 2}, 0, false},
      {"respiration is not a sample", bytes_of({0xF9, 0x14, 0xF8, 0x81}), {1}, 0, false},
      {"more values than a marker has", bytes_of({0xFA, 0x48, 0x49, 0xF8, 0x81}), {1}, 1, false},
      {"lead off", bytes_of({0xF8, 0x81, 0xFB, 0x11, 0xF8, 0x80}), {1, 0}, 0, true},
      {"another info byte", bytes_of({0xFB, 0x12, 0xF8, 0x81}), {1}, 0, false},
      {"on again with a pulse", bytes_of({0xFB, 0x11, 0xF8, 0x80, 0xFA, 0x48, 0xF8, 0x81}), {0, 1}, 0, false},
      {"a pulse of zero is none", bytes_of({0xFB, 0x11, 0xFA, 0x00, 0xF8, 0x81}), {1}, 0, true},
      {"info truncated", bytes_of({0xF8, 0x81, 0xFB}), {1}, 0, false},
  };
  for (const MedlabCase& c : cases) {
    SCOPED_TRACE(c.what);
    Received received;
    MedlabProtocol protocol({}, received.sink(), received.health);
    ScriptedLink link;
    protocol.on_open(link, kStart);
    EXPECT_EQ(link.sent, "NS0G1");
    protocol.on_bytes(link, c.bytes, kStart);
    EXPECT_EQ(received.counts(0.02), c.counts);
    EXPECT_EQ(received.health.damaged.get(), c.damaged);
    EXPECT_EQ(!received.blocks.empty() && received.blocks.back().lead_off, c.lead_off_at_end);
  }
}

TEST(Medlab, LeadOffBeginsABlockOfItsOwn) {
  Received received;
  MedlabProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  protocol.on_bytes(link, bytes_of({0xF8, 0x81, 0x82, 0xFB, 0x11, 0xF8, 0x80}), kStart);
  ASSERT_EQ(received.blocks.size(), 2U);
  EXPECT_FALSE(received.blocks[0].lead_off);
  EXPECT_EQ(received.blocks[0].count, 2U);
  EXPECT_TRUE(received.blocks[1].lead_off);
  EXPECT_EQ(received.blocks[1].device_sequence, 2U);
}

TEST(EcgProtocol, ALongChunkIsCutIntoBlocksInOrder) {
  Received received;
  MedlabProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  std::vector<std::byte> bytes(1 + 200, std::byte{0x80});
  bytes[0] = std::byte{0xF8};
  protocol.on_bytes(link, bytes, kStart);
  ASSERT_EQ(received.blocks.size(), 4U);
  std::uint32_t next = 0;
  Instant last{};
  for (const EcgBlock& block : received.blocks) {
    EXPECT_EQ(block.device_sequence, next);
    EXPECT_GT(block.first_sample_time, last);
    next += block.count;
    last = block.last_sample_time();
    EXPECT_LE(last, block.arrival);
  }
  EXPECT_EQ(next, 200U);
}

TEST(EcgProtocol, SilenceIsSaidAndThenTheLinkIsOpenedAnew) {
  Received received;
  MedlabProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  protocol.on_bytes(link, bytes_of({0xF8, 0x81}), kStart + milliseconds(100));
  EXPECT_EQ(received.health.state(), DeviceState::kStreaming);
  EXPECT_EQ(protocol.next_time(), kStart + milliseconds(400));
  protocol.on_time(link, kStart + milliseconds(400));
  EXPECT_EQ(received.health.state(), DeviceState::kSilent);
  EXPECT_TRUE(link.failure.empty());
  protocol.on_time(link, kStart + milliseconds(2100));
  EXPECT_THAT(link.failure, HasSubstr("no sample for 2 s"));
}

// `rate_hz`: of the module, which sends what it has 20 times a second.
void run_medlab(MedlabProtocol& protocol, ScriptedLink& link, double rate_hz, Instant begin, Duration lasting) {
  protocol.on_bytes(link, bytes_of({0xF8}), begin);
  double owed = 0.0;
  for (Duration t{0}; t < lasting && link.failure.empty(); t += milliseconds(50)) {
    owed += rate_hz * 0.05;
    const auto whole = static_cast<std::size_t>(owed);
    owed -= static_cast<double>(whole);
    while (link.failure.empty() && protocol.next_time() <= begin + t) protocol.on_time(link, protocol.next_time());
    protocol.on_bytes(link, std::vector<std::byte>(whole, std::byte{0x81}), begin + t);
  }
}

TEST(Medlab, OneThatWasNotToldItsRateIsGivenUpAndTakenAgainOnlyAtTheRightOne) {
  Received received;
  MedlabProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  run_medlab(protocol, link, 100.0, kStart, seconds(10));
  EXPECT_THAT(link.failure, HasSubstr("100.0 samples come a second, and the protocol has 300"));
  const std::uint64_t taken = received.health.samples.get();
  EXPECT_LE(taken, 100U) << "a second";

  // At the next opening it still has not heard it: not a sample is taken, and it is told again.
  ScriptedLink again;
  protocol.on_open(again, kStart + seconds(20));
  EXPECT_EQ(again.sent, "NS0G1");
  run_medlab(protocol, again, 100.0, kStart + seconds(20), seconds(10));
  EXPECT_THAT(again.failure, HasSubstr("100.0 samples come a second, and the protocol has 300"));
  EXPECT_EQ(received.health.samples.get(), taken);

  // One from which nothing comes says nothing of its rate.
  ScriptedLink off;
  protocol.on_open(off, kStart + seconds(30));
  while (off.failure.empty()) protocol.on_time(off, protocol.next_time());
  EXPECT_THAT(off.failure, HasSubstr("not a byte"));

  ScriptedLink told;
  protocol.on_open(told, kStart + seconds(40));
  received.health.set_reason(again.failure);
  run_medlab(protocol, told, 300.0, kStart + seconds(40), seconds(4));
  EXPECT_EQ(told.failure, "");
  EXPECT_EQ(received.health.reason(), "");
  EXPECT_GE(received.health.samples.get(), taken + 600U);
  EXPECT_EQ(received.health.state(), DeviceState::kStreaming);
}

TEST(Medlab, BytesThatHoldNoSampleSayNothingOfItsRate) {
  Received received;
  MedlabProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  run_medlab(protocol, link, 300.0, kStart, seconds(2));
  for (Duration t{0}; t < seconds(1); t += milliseconds(50)) {
    protocol.on_bytes(link, bytes_of({0xFA, 0x48}), kStart + seconds(2) + t);
  }
  run_medlab(protocol, link, 300.0, kStart + seconds(3), seconds(2));
  EXPECT_EQ(link.failure, "");
  EXPECT_GE(received.health.samples.get(), 1190U);
}

TEST(EcgProtocol, BytesWithoutSenseSuggestTheWrongRateAndNoBytesThatItIsOff) {
  for (const bool bytes : {false, true}) {
    Received received;
    CytonProtocol protocol({}, received.sink(), received.health);
    ScriptedLink link;
    protocol.on_open(link, kStart);
    if (bytes) protocol.on_bytes(link, std::vector<std::byte>(500, std::byte{0x55}), kStart + milliseconds(100));
    while (link.failure.empty()) protocol.on_time(link, protocol.next_time());
    EXPECT_LT(protocol.next_time(), kStart + seconds(9));
    EXPECT_THAT(link.failure, HasSubstr(bytes ? "wrong baud rate" : "not a byte"));
    EXPECT_TRUE(received.blocks.empty());
  }
}

// ---- BITalino and Cyton: frames with a count

std::vector<std::byte> bitalino_frame(unsigned sequence, unsigned value) {
  auto frame = bytes_of(
      {static_cast<int>(value << 2U & 0xFFU), static_cast<int>(value >> 6U), static_cast<int>(sequence % 16 << 4U)});
  frame[2] |= static_cast<std::byte>(bitalino_crc(frame));
  return frame;
}

// As a board with two inputs taken sends it; `low` is of the one with the lower number.
std::vector<std::byte> bitalino_frame_of_two(unsigned sequence, unsigned low, unsigned high) {
  auto frame = bytes_of({static_cast<int>(high & 0xFFU), static_cast<int>((low << 2U | high >> 8U) & 0xFFU),
                         static_cast<int>(low >> 6U), static_cast<int>(sequence % 16 << 4U)});
  frame[3] |= static_cast<std::byte>(bitalino_crc(frame));
  return frame;
}

std::vector<std::byte> cyton_packet(unsigned count, int value, int channel_5 = 0) {
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

void append(std::vector<std::byte>& to, const std::vector<std::byte>& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

// Drives either protocol through the same trials.
struct Counted {
  const char* name;
  std::vector<std::byte> (*frame)(unsigned count, int value);
  std::function<std::unique_ptr<EcgProtocol>(Received&)> protocol;
  double count_mV;
  double offset;
  unsigned modulus;
  Duration period;
  unsigned held_back;                  // frames that wait for the next to agree
  double breath_count = 0.0;           // of the respiration channel; 0: it has none
  int (*breath)(int value) = nullptr;  // what that channel measures together with this sample of the ECG

  [[nodiscard]] bool cyton() const { return std::string_view(name).starts_with("Cyton"); }
  // Every sample of respiration stands beside the sample of the ECG that was measured with it, at the same instant.
  void expect_breaths_beside_the_ecg(const Received& received) const {
    if (breath == nullptr) {
      EXPECT_TRUE(received.breaths.empty());
      return;
    }
    std::map<std::uint32_t, std::pair<int, Instant>> ecg;
    std::size_t at = 0;
    const std::vector<int> counts = values(received);
    for (const EcgBlock& block : received.blocks) {
      for (std::uint32_t i = 0; i < block.count; ++i) {
        ecg[block.device_sequence + i] = {counts[at++], block.first_sample_time + i * block.sample_period};
      }
    }
    std::size_t breaths = 0;
    for (const RespirationBlock& block : received.breaths) {
      for (std::uint32_t i = 0; i < block.count; ++i, ++breaths) {
        const auto& [value, time] = ecg.at(block.device_sequence + i);
        EXPECT_EQ(std::lround(static_cast<double>(block.values[i]) / breath_count), breath(value));
        EXPECT_LE(std::chrono::abs(block.first_sample_time + i * block.sample_period - time), milliseconds(1));
      }
      EXPECT_LE(block.first_sample_time, block.arrival);
    }
    EXPECT_EQ(breaths, counts.size());
  }

  std::vector<int> values(const Received& received) const {
    std::vector<int> all;
    for (const EcgBlock& block : received.blocks) {
      for (const float mV : block.samples()) all.push_back(static_cast<int>(std::lround(mV / count_mV + offset)));
    }
    return all;
  }
  void open(EcgProtocol& protocol_, ScriptedLink& link) const {
    protocol_.on_open(link, kStart);
    if (cyton()) {
      const std::string_view greeting = "OpenBCI V3\n$$$";
      protocol_.on_bytes(link, std::as_bytes(std::span(greeting.data(), greeting.size())), kStart);
    }
  }
};

const Counted kCounted[] = {
    {"BITalino", [](unsigned count, int value) { return bitalino_frame(count, static_cast<unsigned>(value)); },
     [](Received& r) { return std::make_unique<BitalinoProtocol>(BitalinoSettings{}, r.sink(), r.health); },
     3000.0 / 1024 / 1000, 512, 16, milliseconds(1), 1},
    {"Cyton", [](unsigned count, int value) { return cyton_packet(count, value); },
     [](Received& r) { return std::make_unique<CytonProtocol>(CytonSettings{}, r.sink(), r.health); },
     4500.0 / 24 / 0x7FFFFF, 0, 256, milliseconds(4), 0},
    {"BITalino, breathing on A3",
     [](unsigned count, int value) {
       return bitalino_frame_of_two(count, static_cast<unsigned>(value), static_cast<unsigned>(1000 - value / 2));
     },
     [](Received& r) {
       return std::make_unique<BitalinoProtocol>(BitalinoSettings{.channel = 2, .respiration_channel = 3}, r.sink(),
                                                 r.health);
     },
     3000.0 / 1024 / 1000, 512, 16, milliseconds(1), 1, 3300.0 / 1024, [](int value) { return 488 - value / 2; }},
    {"BITalino, breathing on A1",
     [](unsigned count, int value) {
       return bitalino_frame_of_two(count, static_cast<unsigned>(1000 - value / 2), static_cast<unsigned>(value));
     },
     [](Received& r) {
       return std::make_unique<BitalinoProtocol>(BitalinoSettings{.channel = 2, .respiration_channel = 1}, r.sink(),
                                                 r.health);
     },
     3000.0 / 1024 / 1000, 512, 16, milliseconds(1), 1, 3300.0 / 1024, [](int value) { return 488 - value / 2; }},
    {"Cyton, breathing on 5", [](unsigned count, int value) { return cyton_packet(count, value, 3 - 7 * value); },
     [](Received& r) {
       return std::make_unique<CytonProtocol>(CytonSettings{.respiration_channel = 5}, r.sink(), r.health);
     },
     4500.0 / 24 / 0x7FFFFF, 0, 256, milliseconds(4), 0, 4500.0 / 24 / 0x7FFFFF,
     [](int value) { return 3 - 7 * value; }},
};

TEST(CountedProtocols, DecodeTheSameHoweverTheBytesAreCut) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    std::vector<std::byte> stream;
    std::vector<int> sent(300);
    std::iota(sent.begin(), sent.end(), 100);
    for (int i = 0; i < 300; ++i)
      append(stream, device.frame(static_cast<unsigned>(i), sent[static_cast<std::size_t>(i)]));
    for (const std::size_t cut : {std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{64}, stream.size()}) {
      Received received;
      const auto protocol = device.protocol(received);
      ScriptedLink link;
      device.open(*protocol, link);
      for (std::size_t at = 0; at < stream.size(); at += cut) {
        protocol->on_bytes(link, std::span(stream).subspan(at, std::min(cut, stream.size() - at)),
                           kStart + at * std::chrono::microseconds(50));
      }
      EXPECT_EQ(device.values(received), std::vector<int>(sent.begin(), sent.end() - device.held_back));
      device.expect_breaths_beside_the_ecg(received);
      EXPECT_EQ(received.health.damaged.get(), 0U);
      EXPECT_EQ(received.health.lost.get(), 0U);
    }
  }
}

TEST(CountedProtocols, StartInTheMiddleOfAFrame) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    std::vector<std::byte> stream;
    for (unsigned i = 0; i < 50; ++i) append(stream, device.frame(i, 200 + static_cast<int>(i)));
    Received received;
    const auto protocol = device.protocol(received);
    ScriptedLink link;
    device.open(*protocol, link);
    protocol->on_bytes(link, std::span(stream).subspan(2), kStart);
    std::vector<int> sent(49 - device.held_back);
    std::iota(sent.begin(), sent.end(), 201);
    EXPECT_EQ(device.values(received), sent);
    device.expect_breaths_beside_the_ecg(received);
  }
}

TEST(CountedProtocols, GapsAreCountedHoweverOftenTheCountWentRound) {
  for (const Counted& device : kCounted) {
    for (const unsigned gap :
         {1U, 5U, device.modulus - 1, device.modulus, device.modulus + 3, 3 * device.modulus + 1}) {
      SCOPED_TRACE(std::string(device.name) + " " + std::to_string(gap));
      Received received;
      const auto protocol = device.protocol(received);
      ScriptedLink link;
      device.open(*protocol, link);
      unsigned count = 0;
      for (; count < 1000; ++count) protocol->on_bytes(link, device.frame(count, 300), kStart + count * device.period);
      count += gap;
      for (const unsigned end = count + 50; count < end; ++count)
        protocol->on_bytes(link, device.frame(count, 400), kStart + count * device.period);
      // A count that went round exactly once looks like none missing: only where the rest of the gap shows is it seen.
      // The frame before a gap has no successor that would vouch for it.
      const std::uint64_t expected = gap == device.modulus ? 0 : gap + device.held_back;
      EXPECT_EQ(received.health.lost.get(), expected);
      if (gap == device.modulus) continue;
      EXPECT_EQ(received.blocks.back().device_sequence, count - 1 - device.held_back);
    }
  }
}

// Every sample that comes out was sent, whatever happens to the bytes; and most of what was sent comes out.
TEST(CountedProtocols, GarbledStreamsGiveNoSampleThatWasNotSent) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    std::mt19937 random(3);
    Received received;
    const auto protocol = device.protocol(received);
    ScriptedLink link;
    device.open(*protocol, link);
    constexpr int kFrames = 20000;
    std::size_t whole = 0;
    for (int i = 0; i < kFrames; ++i) {
      // Sample values that a shifted or mixed-up frame would hardly show.
      auto frame = device.frame(static_cast<unsigned>(i), 500 + i % 7);
      const auto dice = random() % 100;
      if (dice == 0) frame.resize(random() % frame.size());         // truncated
      if (dice == 1) frame.insert(frame.begin(), std::byte{0xA0});  // a byte too many
      if (dice == 2) frame.clear();                                 // lost
      // The frame's shape or check is hit; a Cyton has no check that would notice its samples changed.
      if (dice == 3) frame[device.cyton() ? 32 : 0] ^= std::byte{0x10};
      whole += dice > 3 || dice == 1 ? 1 : 0;
      protocol->on_bytes(link, frame, kStart + i * device.period);
    }
    const std::vector<int> values = device.values(received);
    std::size_t strange = 0;
    for (const int value : values) strange += value < 500 || value > 506 ? 1 : 0;
    EXPECT_EQ(strange, 0U);
    device.expect_breaths_beside_the_ecg(received);
    EXPECT_LE(values.size(), whole);
    EXPECT_GT(values.size(), whole * 85 / 100);
    // Delivered and lost together are what the device sent, to the last frames still held back.
    EXPECT_NEAR(static_cast<double>(values.size() + received.health.lost.get()), kFrames, 8);
  }
}

TEST(CountedProtocols, ABoardAtAnotherRateIsGivenUpWithThatReason) {
  for (const Counted& device : kCounted) {
    for (const double times : {0.1, 0.5, 0.9, 1.1, 2.0}) {
      SCOPED_TRACE(std::string(device.name) + " " + std::to_string(times));
      Received received;
      const auto protocol = device.protocol(received);
      ScriptedLink link;
      device.open(*protocol, link);
      const double period_ns = static_cast<double>(device.period.count()) / times;
      std::uint64_t taken = 0;
      for (unsigned i = 0; i * period_ns < 10e9; ++i) {
        if (link.failure.empty()) taken = received.health.samples.get();
        protocol->on_bytes(link, device.frame(i, 300), kStart + Duration(std::llround(i * period_ns)));
      }
      const double rate_hz = 1e9 / static_cast<double>(device.period.count());
      EXPECT_THAT(link.failure, HasSubstr(fmt::format("{:.1f} samples come a second, and the protocol has {:g}",
                                                      times * rate_hz, rate_hz)));
      EXPECT_EQ(received.health.samples.get(), taken);
      EXPECT_LT(static_cast<double>(taken), 3.0 * times * rate_hz);
    }
  }
}

// One frame in ten is lost, and every two seconds the link stands still for 0.4 s and gives what came meanwhile at
// once.
TEST(CountedProtocols, LostFramesAndBurstsAreNoWrongRate) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    std::mt19937 random(5);
    Received received;
    const auto protocol = device.protocol(received);
    ScriptedLink link;
    device.open(*protocol, link);
    std::vector<std::byte> waiting;
    for (unsigned i = 0; i * device.period < seconds(30); ++i) {
      const Duration measured = i * device.period;
      if (random() % 10 != 0) append(waiting, device.frame(i, 300));
      if (measured % seconds(2) < milliseconds(400)) continue;
      protocol->on_bytes(link, waiting, kStart + measured);
      waiting.clear();
    }
    EXPECT_EQ(link.failure, "");
    EXPECT_EQ(received.health.reason(), "");
    EXPECT_GT(received.health.lost.get(), 0U);
  }
}

TEST(CountedProtocols, RandomBytesGiveNothing) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    std::mt19937 random(11);
    Received received;
    const auto protocol = device.protocol(received);
    ScriptedLink link;
    device.open(*protocol, link);
    std::vector<std::byte> noise(100000);
    for (std::byte& b : noise) b = static_cast<std::byte>(random() % 256);
    protocol->on_bytes(link, noise, kStart);
    // BITalino: four frames in a row pass CRC-4 and sequence by chance once in 16^7 places.
    EXPECT_TRUE(received.blocks.empty());
    EXPECT_TRUE(received.breaths.empty());
  }
}

TEST(CountedProtocols, ARailIsLeadOffAfterATenthOfASecond) {
  for (const Counted& device : kCounted) {
    SCOPED_TRACE(device.name);
    const int rail = device.cyton() ? 0x7FFFFF : 1023;
    Received received;
    const auto protocol = device.protocol(received);
    ScriptedLink link;
    device.open(*protocol, link);
    const auto second = static_cast<unsigned>(seconds(1) / device.period);
    for (unsigned i = 0; i < 3 * second; ++i) {
      protocol->on_bytes(link, device.frame(i, i >= second && i < 2 * second ? rail : 512), kStart + i * device.period);
    }
    std::vector<unsigned> changes;
    for (std::size_t i = 1; i < received.blocks.size(); ++i) {
      if (received.blocks[i].lead_off != received.blocks[i - 1].lead_off)
        changes.push_back(received.blocks[i].device_sequence);
    }
    EXPECT_THAT(changes, ElementsAre(second + second / 10 - 1, 2 * second + second / 2 - 1));
  }
}

TEST(Cyton, WaitsForThePromptAndTakesTheBoardsName) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  EXPECT_THAT(commands_until(protocol, link, kStart + seconds(1)),
              ElementsAre(Pair(milliseconds(250), "s"), Pair(milliseconds(350), "v")));
  const auto say = [&](std::string_view text) {
    protocol.on_bytes(link, std::as_bytes(std::span(text.data(), text.size())), kStart + seconds(1));
  };
  say(std::string(5000, '\xA0'));
  say("OpenBCI V3 8-16 channel\nFirmware: v3.1.2\n$");
  EXPECT_EQ(link.take_sent(), "");
  say("$$");
  EXPECT_THAT(commands_until(protocol, link, kStart + milliseconds(1500)), ElementsAre(Pair(milliseconds(1100), "b")));
  EXPECT_THAT(received.health.identity(), HasSubstr("Firmware: v3.1.2"));
}

void say(CytonProtocol& protocol, ScriptedLink& link, std::string_view text, Instant arrival) {
  protocol.on_bytes(link, std::as_bytes(std::span(text.data(), text.size())), arrival);
}

TEST(Cyton, ABoardThatHasGreetedAndIsSilentYetIsToldToBeginAndNotReset) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  say(protocol, link, "OpenBCI V3\n$$$", kStart + seconds(1));
  const Instant first = kStart + seconds(9);
  const auto commands = commands_until(protocol, link, first);
  EXPECT_EQ(link.failure, "");
  ASSERT_EQ(commands.size(), 16U);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_THAT(commands[i], Pair(milliseconds(1100 + 500 * i), "b"));
  }
  for (unsigned i = 0; i < 10; ++i) protocol.on_bytes(link, cyton_packet(i, 77), first + i * milliseconds(4));
  EXPECT_EQ(received.health.state(), DeviceState::kStreaming);
  // Told again, a board that streams would begin its count anew.
  EXPECT_GT(protocol.next_time(), first + milliseconds(300));
  EXPECT_EQ(link.take_sent(), "");
}

TEST(Cyton, ABoardThatHasGreetedAndStaysSilentIsGivenUpWithThatReason) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  say(protocol, link, "OpenBCI V3\n$$$", kStart + seconds(1));
  while (link.failure.empty()) protocol.on_time(link, protocol.next_time());
  EXPECT_THAT(link.failure, HasSubstr("sends no sample"));
}

// However late it greets within five seconds of the last question, it is not asked again before its first sample.
TEST(Cyton, ASlowGreetingIsAwaited) {
  for (const Duration late : {milliseconds(100), milliseconds(1900), milliseconds(4900)}) {
    Received received;
    CytonProtocol protocol({}, received.sink(), received.health);
    ScriptedLink link;
    protocol.on_open(link, kStart);
    const Instant greeting = kStart + milliseconds(3550) + late;
    (void)commands_until(protocol, link, greeting);
    say(protocol, link, "OpenBCI V3\n$$$", greeting);
    const auto commands = commands_until(protocol, link, greeting + milliseconds(200));
    EXPECT_THAT(commands, ElementsAre(Pair(greeting - kStart + milliseconds(100), "b")));
    EXPECT_EQ(link.failure, "");
  }
}

// A dongle whose board is off answers in its place, in words that end as a greeting does.
TEST(Cyton, ADonglesWordThatNoBoardAnswersIsNoGreeting) {
  constexpr std::string_view kNoBoard = "Failure: Communications timeout - Device failed to poll Host$$$";
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  received.health.set_reason("open, but not a byte");
  ScriptedLink link;
  protocol.on_open(link, kStart);
  EXPECT_THAT(received.health.awaited(), HasSubstr("no answer yet to v"));
  say(protocol, link, kNoBoard, kStart + milliseconds(500));
  EXPECT_THAT(received.health.awaited(), HasSubstr("is the board switched on"));
  EXPECT_EQ(received.health.reason(), "") << "bytes have come since";
  say(protocol, link, "Failure: Communications time", kStart + milliseconds(600));
  EXPECT_THAT(commands_until(protocol, link, kStart + seconds(2)),
              ElementsAre(Pair(milliseconds(250), "s"), Pair(milliseconds(350), "v"), Pair(milliseconds(1850), "s"),
                          Pair(milliseconds(1950), "v")));
  // The board is switched on.
  say(protocol, link, "OpenBCI V3\n$$$", kStart + seconds(2));
  EXPECT_THAT(received.health.identity(), ::testing::StartsWith("OpenBCI V3"));
  EXPECT_THAT(received.health.awaited(), HasSubstr("told its name"));
  EXPECT_THAT(commands_until(protocol, link, kStart + milliseconds(2200)), ElementsAre(Pair(milliseconds(2100), "b")));

  ScriptedLink off;
  protocol.on_open(off, kStart);
  say(protocol, off, kNoBoard, kStart + milliseconds(500));
  while (off.failure.empty()) protocol.on_time(off, protocol.next_time());
  EXPECT_THAT(off.failure, HasSubstr("reaches no board"));
}

TEST(Cyton, OneThatGoesOnSendingAndHearsNothingIsNotTakenForAnotherDevice) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  for (unsigned i = 0; i < 10; ++i) protocol.on_bytes(link, cyton_packet(i, 77), kStart + i * milliseconds(4));
  EXPECT_THAT(received.health.awaited(), HasSubstr("sends samples"));
  while (link.failure.empty()) protocol.on_time(link, protocol.next_time());
  EXPECT_THAT(link.failure, HasSubstr("switch the board off and on"));
  EXPECT_TRUE(received.blocks.empty());
}

// One that takes longer is waited for longer at the next openings, each of which makes it begin anew; then less again,
// for a board that was off and has to be asked.
TEST(Cyton, AnEvenSlowerGreetingIsAwaitedAtALaterOpening) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  std::vector<Duration> openings;
  for (int i = 0; i < 4; ++i) {
    ScriptedLink link;
    protocol.on_open(link, kStart);
    Instant last = kStart;
    for (; link.failure.empty(); protocol.on_time(link, last)) last = protocol.next_time();
    openings.push_back(last - kStart);
  }
  EXPECT_THAT(openings, ElementsAre(milliseconds(8550), milliseconds(11550), milliseconds(17550), milliseconds(8550)));
  // Once it has greeted the next opening is as the first.
  ScriptedLink link;
  protocol.on_open(link, kStart);
  say(protocol, link, "OpenBCI V3\n$$$", kStart + seconds(11));
  ScriptedLink again;
  protocol.on_open(again, kStart);
  while (again.failure.empty()) protocol.on_time(again, protocol.next_time());
  EXPECT_EQ(protocol.next_time(), kStart + milliseconds(8550));
}

TEST(Cyton, AsksAgainWhileItsDongleHearsNothing) {
  Received received;
  CytonProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  std::string sent;
  while (link.failure.empty()) {
    protocol.on_time(link, protocol.next_time());
    sent += link.take_sent();
  }
  EXPECT_EQ(sent, "svsvsv");
}

TEST(Cyton, ReadsNegativeSamplesAndTheChosenChannel) {
  Received received;
  CytonProtocol protocol({.channel = 2, .gain = 24.0}, received.sink(), received.health);
  ScriptedLink link;
  kCounted[1].open(protocol, link);
  for (unsigned i = 0; i < 4; ++i) {
    auto packet = cyton_packet(i, 77);
    packet[5] = std::byte{0xFF};
    packet[6] = std::byte{0xFF};
    packet[7] = std::byte{0x9C};  // -100
    protocol.on_bytes(link, packet, kStart + i * milliseconds(4));
  }
  EXPECT_EQ(received.counts(4500.0 / 24 / 0x7FFFFF), (std::vector<int>{-100, -100, -100, -100}));
}

TEST(Bitalino, StartsLiveAcquisitionOfItsChannel) {
  Received received;
  BitalinoProtocol protocol({.channel = 2}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  const std::string idle(1, '\0');
  EXPECT_EQ(link.take_sent(), idle);
  EXPECT_THAT(
      commands_until(protocol, link, kStart + seconds(1)),
      ElementsAre(Pair(milliseconds(150), "\x07"), Pair(milliseconds(300), "\xC3"), Pair(milliseconds(450), "\x09")));
}

// In any chunks; a board that does not tell its name loses no frame.
TEST(Bitalino, TellsItsFirmwareAndLosesNoSampleOverIt) {
  for (const std::string name : {"BITalino_v5.2\n", ""}) {
    std::vector<std::byte> bytes;
    for (const char c : name) bytes.push_back(static_cast<std::byte>(c));
    for (unsigned i = 0; i < 12; ++i) {
      const auto frame = bitalino_frame_of_two(i, 512, 300);
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    }
    for (const std::size_t chunk : {std::size_t{1}, std::size_t{5}, bytes.size()}) {
      Received received;
      BitalinoProtocol protocol({.channel = 2, .respiration_channel = 3}, received.sink(), received.health);
      ScriptedLink link;
      protocol.on_open(link, kStart);
      for (std::size_t at = 0; at < bytes.size(); at += chunk) {
        protocol.on_bytes(link, std::span(bytes).subspan(at, std::min(chunk, bytes.size() - at)), kStart);
      }
      EXPECT_EQ(received.health.identity(), name.substr(0, name.find('\n'))) << chunk;
      EXPECT_EQ(received.health.samples.get(), 11U) << chunk;
      EXPECT_EQ(received.health.damaged.get(), 0U) << chunk;
    }
  }
}

// A text of another device, without an end, is not waited for.
TEST(Bitalino, WhatOnlyBeginsLikeANameIsNoIdentity) {
  Received received;
  BitalinoProtocol protocol({}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  const std::string text = "BITalino" + std::string(100, 'x') + "\n";
  protocol.on_bytes(link, std::as_bytes(std::span(text.data(), text.size())), kStart);
  EXPECT_EQ(received.health.identity(), "");
  EXPECT_GT(received.health.damaged.get(), 0U);
}

TEST(Bitalino, StartsLiveAcquisitionOfRespirationToo) {
  Received received;
  BitalinoProtocol protocol({.channel = 2, .respiration_channel = 6}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  EXPECT_THAT(commands_until(protocol, link, kStart + seconds(1)),
              ElementsAre(Pair(milliseconds(150), ::testing::_), Pair(milliseconds(300), ::testing::_),
                          Pair(milliseconds(450), "\x89")));
}

// A belt that is too tight cuts the top off every breath; one that is not connected stays there.
TEST(Bitalino, ABreathSensorIsOffAfterFiveSecondsAtARailAndTheLeadIsOn) {
  Received received;
  BitalinoProtocol protocol({.channel = 2, .respiration_channel = 3}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  for (unsigned i = 0; i < 12000; ++i) {
    const bool cut_top = i < 3000;
    const bool open = i >= 4000 && i < 11000;
    protocol.on_bytes(link, bitalino_frame_of_two(i, 512, cut_top || open ? 1023 : 300), kStart + i * milliseconds(1));
  }
  std::vector<unsigned> changes;
  for (std::size_t i = 1; i < received.breaths.size(); ++i) {
    if (received.breaths[i].sensor_off != received.breaths[i - 1].sensor_off)
      changes.push_back(received.breaths[i].device_sequence);
  }
  EXPECT_THAT(changes, ElementsAre(8999, 11499));
  for (const EcgBlock& block : received.blocks) EXPECT_FALSE(block.lead_off);
}

// ---- CAN

CanFrame can_frame(std::uint8_t count, std::uint16_t ms, std::int16_t first, std::int16_t second) {
  return encode_can_ecg({count, false, false, 2, ms, {first, second}}, 0x2E0, false);
}

TEST(CanEcg, EveryFieldSurvivesTheFrame) {
  for (const CanEcgFrame& ecg :
       {CanEcgFrame{255, true, true, 1, 65535, {-32768, 32767}},
        CanEcgFrame{254, false, false, 1, 65534, {-32767, 32766}, true, false},
        CanEcgFrame{1, true, false, 1, 0, {1, -1}, true, true}, CanEcgFrame{0, false, false, 2, 7, {0, 0}}}) {
    EXPECT_EQ(decode_can_ecg(encode_can_ecg(ecg, 0x1ABCDEF, true), 0x1ABCDEF, true), ecg);
  }
}

TEST(CanEcg, OtherFramesAreNone) {
  const CanFrame good = can_frame(1, 2, 3, 4);
  CanFrame frame = good;
  frame.identifier = 0x2E1;
  EXPECT_FALSE(decode_can_ecg(frame, 0x2E0, false));
  frame = good;
  frame.extended = true;
  EXPECT_FALSE(decode_can_ecg(frame, 0x2E0, false));
  frame = good;
  frame.error = true;
  EXPECT_FALSE(decode_can_ecg(frame, 0x2E0, false));
  for (std::uint8_t length = 0; length < 8; ++length) {
    frame = good;
    frame.length = length;
    EXPECT_FALSE(decode_can_ecg(frame, 0x2E0, false));
  }
}

TEST(CanEcg, TheDatabaseFileSaysWhatTheCodeDoes) {
  std::ifstream file(PERIMAP_CONFIG "/perimap_ecg.dbc");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_THAT(text, HasSubstr("BO_ 736 PerimapEcg: 8"));  // 0x2E0
  EXPECT_EQ(CanEcgSettings{}.identifier, 736U);
  // Respiration stands in the second sample's place: m0 and m1 are told apart by the signal M.
  for (const bool breathes : {false, true}) {
    SCOPED_TRACE(breathes);
    const CanEcgFrame ecg{17, false, true, 1, 40000, {-2, 1234}, breathes, breathes};
    const CanFrame frame = encode_can_ecg(ecg, 736, false);
    const std::map<std::string, double> expected{
        {"FrameCount", 17},
        {"LeadOff", 0},
        {"RPeak", 1},
        {"SecondIsRespiration", breathes ? 1 : 0},
        {"RespirationOff", breathes ? 1 : 0},
        {"OneSample", breathes ? 0 : 1},
        {"DeviceTime", 40000},
        {"Sample0", -2 * 0.005},
        {breathes ? "Respiration" : "Sample1", breathes ? 1234 : 1234 * 0.005}};
    const std::regex signal(R"(SG_ (\w+) (M |m[01] )?: (\d+)\|(\d+)@1([+-]) \(([\d.]+),0\))");
    std::size_t found = 0;
    for (std::sregex_iterator it(text.begin(), text.end(), signal), end; it != end; ++it) {
      if ((*it)[2] == (breathes ? "m0 " : "m1 ")) continue;
      std::uint64_t raw = 0;
      for (std::size_t i = 0; i < 8; ++i) raw |= static_cast<std::uint64_t>(frame.data[i]) << (8 * i);
      const unsigned length = static_cast<unsigned>(std::stoi((*it)[4]));
      std::uint64_t bits = raw >> static_cast<unsigned>(std::stoi((*it)[3])) & ((std::uint64_t{1} << length) - 1);
      double value = static_cast<double>(bits);
      if ((*it)[5] == "-" && (bits >> (length - 1) & 1U) != 0) value -= std::pow(2.0, length);
      EXPECT_NEAR(value * std::stod((*it)[6]), expected.at((*it)[1]), 1e-9) << (*it)[1];
      ++found;
    }
    EXPECT_EQ(found, expected.size());
  }
}

TEST(CanEcg, GapsErrorsAndOverflowsAreCounted) {
  Received received;
  CanEcgDecoder decoder({}, received.sink(), received.health);
  // 360 Hz, two samples a frame: 5.556 ms.
  const auto frame = [&](int i) {
    CanFrame f = can_frame(static_cast<std::uint8_t>(i), static_cast<std::uint16_t>(i * 50 / 9),
                           static_cast<std::int16_t>(i), 0);
    f.arrival = kStart + i * std::chrono::microseconds(5556);
    return f;
  };
  for (int i = 0; i < 100; ++i) decoder.decode_frame(frame(i));
  EXPECT_EQ(received.health.samples.get(), 200U);
  decoder.decode_frame(frame(103));
  EXPECT_EQ(received.health.lost.get(), 6U);
  decoder.decode_frame(frame(103));  // the same again
  EXPECT_EQ(received.health.samples.get(), 202U);
  decoder.decode_frame(frame(104 + 256 * 3));  // the count went round three times
  EXPECT_EQ(received.health.lost.get(), 6U + 2 * 256 * 3);
  CanFrame error = frame(0);
  error.error = true;
  error.identifier = 0x04;  // CAN_ERR_CRTL
  decoder.decode_frame(error);
  EXPECT_EQ(received.health.bus_errors.get(), 1U);
  EXPECT_EQ(received.health.reason(), "");
  error.identifier = 0x40;  // CAN_ERR_BUSOFF
  decoder.decode_frame(error);
  EXPECT_EQ(received.health.bus_errors.get(), 2U);
  EXPECT_THAT(received.health.reason(), HasSubstr("off the bus"));
  CanFrame after_overflow = frame(105 + 256 * 3);
  after_overflow.dropped_before = 7;
  decoder.decode_frame(after_overflow);
  EXPECT_EQ(received.health.dropped.get(), 7U);
  EXPECT_EQ(received.health.samples.get(), 206U);
}

// Frames of one sample and one of respiration, at 360 Hz.
TEST(CanEcg, RespirationComesWithTheSampleThatItWasTakenWith) {
  Received received;
  CanEcgDecoder decoder({}, received.sink(), received.health);
  const auto frame = [&](int i, bool off) {
    const auto ms = static_cast<std::uint16_t>(i * 25 / 9);
    CanFrame f = encode_can_ecg({static_cast<std::uint8_t>(i),
                                 false,
                                 false,
                                 1,
                                 ms,
                                 {static_cast<std::int16_t>(i), static_cast<std::int16_t>(-3 * i)},
                                 true,
                                 off},
                                0x2E0, false);
    f.arrival = kStart + i * std::chrono::microseconds(2778);
    return f;
  };
  for (int i = 0; i < 100; ++i) decoder.decode_frame(frame(i, i >= 60 && i < 80));
  decoder.decode_frame(frame(110, false));
  EXPECT_EQ(received.health.lost.get(), 10U) << "a lost frame held one sample of the ECG";
  ASSERT_EQ(received.breaths.size(), 101U);
  ASSERT_EQ(received.blocks.size(), 101U);
  for (std::size_t i = 0; i < 101; ++i) {
    const RespirationBlock& breath = received.breaths[i];
    ASSERT_EQ(breath.count, 1U);
    const int sent = i == 100 ? 110 : static_cast<int>(i);
    EXPECT_EQ(breath.device_sequence, static_cast<std::uint32_t>(sent));
    EXPECT_EQ(breath.values[0], static_cast<float>(-3 * sent));
    EXPECT_EQ(breath.sensor_off, sent >= 60 && sent < 80);
    EXPECT_EQ(breath.first_sample_time, received.blocks[i].first_sample_time);
    EXPECT_EQ(std::lround(received.blocks[i].mV[0] / 0.005F), sent);
  }
}

TEST(CanEcg, AFloodOfErrorsAndOfStrangersIsSilenceOfTheDevice) {
  for (const bool errors : {true, false}) {
    Received received;
    CanEcgDecoder decoder({}, received.sink(), received.health);
    CanFrame good = can_frame(1, 2, 3, 4);
    good.arrival = kStart;
    decoder.decode_frame(good);
    decoder.watch(kStart);
    EXPECT_EQ(received.health.state(), DeviceState::kStreaming);
    for (int i = 1; i < 400; ++i) {
      EXPECT_EQ(received.health.state(), i <= 301 ? DeviceState::kStreaming : DeviceState::kSilent) << i;
      CanFrame frame = good;
      frame.error = errors;
      frame.length = errors ? 8 : 3;
      frame.identifier = errors ? 0x80 : 0x2E0;  // CAN_ERR_BUSERROR
      frame.arrival = kStart + milliseconds(i);
      decoder.decode_frame(frame);
      decoder.watch(frame.arrival);
    }
  }
}

TEST(CanEcg, TheControllersWordsAreTold) {
  Received received;
  CanEcgDecoder decoder({}, received.sink(), received.health);
  CanFrame error;
  error.error = true;
  error.length = 8;
  error.identifier = 0x04;  // CAN_ERR_CRTL
  struct Case {
    std::uint8_t controller;
    const char* reason;
  };
  for (const Case& c : {Case{0x04, ""}, Case{0x01, "has run over"}, Case{0x10, "error-passive"},
                        Case{0x02, "has run over"}, Case{0x20, "error-passive"}}) {
    error.data[1] = c.controller;
    decoder.decode_frame(error);
    EXPECT_THAT(received.health.reason(), HasSubstr(c.reason));
  }
  EXPECT_EQ(received.health.bus_errors.get(), 5U);
}

TEST(CanEcg, WhatIsAwaitedOnASilentBusIsSaid) {
  for (const bool extended : {false, true}) {
    Received received;
    const CanEcgDecoder decoder({.identifier = 0x2E, .extended = extended}, received.sink(), received.health);
    EXPECT_THAT(received.health.awaited(),
                HasSubstr(extended ? "29-bit identifier 0x0000002E" : "11-bit identifier 0x02E"));
    EXPECT_THAT(received.health.awaited(), HasSubstr("bit rate, the identifier and the module"));
  }
}

TEST(CanEcg, SamplesAtAnotherRateThanConfiguredAreNotTakenAndTold) {
  Received received;
  CanEcgDecoder decoder({.sample_rate_hz = 250.0}, received.sink(), received.health);
  const auto run = [&decoder](int from, int to, Duration period, Instant begin) {
    for (int i = from; i < to; ++i) {
      const Duration since = (i - from) * period;
      CanFrame f = can_frame(static_cast<std::uint8_t>(i), static_cast<std::uint16_t>(since / milliseconds(1)), 0, 0);
      f.arrival = begin + since;
      decoder.decode_frame(f);
    }
  };
  // 360 Hz, two samples a frame, for ten seconds.
  run(0, 1800, std::chrono::microseconds(5556), kStart);
  const std::uint64_t taken = received.health.samples.get();
  EXPECT_LT(taken, 7U * 360U);
  EXPECT_THAT(received.health.reason(), HasSubstr("360.0 samples come a second, and can_sample_rate_hz says 250.0"));
  // The module has been set to 250 Hz.
  run(1800, 3050, milliseconds(8), kStart + seconds(11));
  EXPECT_GT(received.health.samples.get(), taken + 6U * 250U);
  EXPECT_EQ(received.health.reason(), "");
}

TEST(CanEcg, RespirationThatNobodyAskedForIsNoSampleOfTheEcg) {
  Received received;
  CanEcgDecoder decoder({}, EcgSinks(received.sink().ecg), received.health);
  CanFrame frame = encode_can_ecg({0, false, false, 1, 0, {7, 30000}, true, false}, 0x2E0, false);
  frame.arrival = kStart;
  decoder.decode_frame(frame);
  EXPECT_EQ(received.counts(0.005), std::vector<int>{7});
  EXPECT_TRUE(received.breaths.empty());
}

}  // namespace
}  // namespace perimap
