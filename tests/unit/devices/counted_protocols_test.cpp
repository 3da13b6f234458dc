// Bytes to stamped samples: BITalino and Cyton, frames with a count.
#include "ecg_decoding.hpp"

namespace perimap {
namespace {

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
    if (cyton()) {
      open_cyton(protocol_, link);
    } else {
      protocol_.on_open(link, kStart);
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

}  // namespace
}  // namespace perimap
