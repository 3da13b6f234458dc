// Bytes to stamped samples: Medlab, and what all protocols do.
#include "ecg_decoding.hpp"

namespace perimap {
namespace {

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

}  // namespace
}  // namespace perimap
