// Bytes to stamped samples: what the Cyton and the BITalino say besides.
#include "ecg_decoding.hpp"

namespace perimap {
namespace {

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

// Read as a Cyton's, every other packet would be of other inputs.
TEST(Cyton, ADaisyIsKnownByTheGreetingAndRefusedByItsName) {
  const std::string_view greeting =
      "OpenBCI V3 8-16 channel\nOn Board ADS1299 Device ID: 0x3E\nOn Daisy ADS1299 Device ID: 0x3E\nFirmware: "
      "v3.1.2\n$$$";
  for (const std::size_t lost : {0U, 10U, 60U}) {  // bytes of its beginning
    Received received;
    CytonProtocol protocol({}, received.sink(), received.health);
    ScriptedLink link;
    protocol.on_open(link, kStart);
    const std::string_view heard = greeting.substr(lost);
    protocol.on_bytes(link, std::as_bytes(std::span(heard.data(), heard.size())), kStart + seconds(1));
    EXPECT_THAT(link.failure, HasSubstr("a Cyton with a Daisy module"));
    EXPECT_THAT(link.failure, HasSubstr("take the Daisy off"));
    EXPECT_EQ(received.health.samples.get(), 0U);
  }
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
  open_cyton(protocol, link);
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

// Of a BITalino's frame in counts from its middle.
std::vector<int> second_counts(const Received& received, double count_mV) {
  std::vector<int> all;
  for (const EcgBlock& block : received.blocks) {
    for (const float mV : block.second_samples()) all.push_back(static_cast<int>(std::lround(mV / count_mV)));
  }
  return all;
}

constexpr double kBitalinoCount_mV = 3300.0 / 1024 / 1100;

TEST(Bitalino, ASecondLeadComesWithTheFirstWhicheverHasTheLowerNumber) {
  for (const auto& [first, second] : {std::pair(2, 5), std::pair(5, 2)}) {
    Received received;
    BitalinoProtocol protocol({.channel = first, .second_channel = second}, received.sink(), received.health);
    ScriptedLink link;
    protocol.on_open(link, kStart);
    EXPECT_THAT(commands_until(protocol, link, kStart + seconds(1)),
                ElementsAre(Pair(milliseconds(150), ::testing::_), Pair(milliseconds(300), ::testing::_),
                            Pair(milliseconds(450), "\x49")));
    for (unsigned i = 0; i < 6; ++i) protocol.on_bytes(link, bitalino_frame_of_two(i, 612, 300), kStart);
    const std::vector<int> low(5, 100);
    const std::vector<int> high(5, -212);
    EXPECT_EQ(received.counts(kBitalinoCount_mV), first < second ? low : high);
    EXPECT_EQ(second_counts(received, kBitalinoCount_mV), first < second ? high : low);
  }
}

TEST(Bitalino, TwoLeadsAndRespirationAreThreeInputs) {
  Received received;
  BitalinoProtocol protocol({.channel = 4, .second_channel = 1, .respiration_channel = 2}, received.sink(),
                            received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  for (unsigned i = 0; i < 6; ++i) {
    protocol.on_bytes(link, bitalino_frame_of_three(i, {1022, 513, 301}), kStart);  // A1, A2, A4
  }
  EXPECT_EQ(received.health.damaged.get(), 0U);
  EXPECT_EQ(received.counts(kBitalinoCount_mV), std::vector<int>(5, -211));
  EXPECT_EQ(second_counts(received, kBitalinoCount_mV), std::vector<int>(5, 510));
  ASSERT_FALSE(received.breaths.empty());
  EXPECT_NEAR(received.breaths[0].samples()[0], 3300.0 / 1024, 1e-4);
}

TEST(Bitalino, OneLeadMayBeOffWithoutTheOther) {
  Received received;
  BitalinoProtocol protocol({.channel = 2, .second_channel = 3}, received.sink(), received.health);
  ScriptedLink link;
  protocol.on_open(link, kStart);
  for (unsigned i = 0; i < 3000; ++i) {
    const bool open = i >= 1000 && i < 2000;
    protocol.on_bytes(link, bitalino_frame_of_two(i, 512 + i % 7, open ? 1023 : 500), kStart + i * milliseconds(1));
  }
  std::vector<unsigned> changes;
  for (std::size_t i = 0; i < received.blocks.size(); ++i) {
    const EcgBlock& block = received.blocks[i];
    EXPECT_TRUE(block.has_second);
    EXPECT_FALSE(block.lead_off);
    EXPECT_FALSE(block.nothing_heard());
    if (i > 0 && block.second_off != received.blocks[i - 1].second_off) changes.push_back(block.device_sequence);
  }
  EXPECT_THAT(changes, ElementsAre(1099, 2499));
}

TEST(Cyton, ASecondLeadComesWithTheFirst) {
  Received received;
  CytonProtocol protocol({.channel = 1, .second_channel = 5, .gain = 24.0}, received.sink(), received.health);
  ScriptedLink link;
  open_cyton(protocol, link);
  for (unsigned i = 0; i < 4; ++i) protocol.on_bytes(link, cyton_packet(i, 77, -40), kStart + i * milliseconds(4));
  constexpr double kCount_mV = 4500.0 / 24 / 0x7FFFFF;
  EXPECT_EQ(received.counts(kCount_mV), std::vector<int>(4, 77));
  EXPECT_EQ(second_counts(received, kCount_mV), std::vector<int>(4, -40));
  Received alone;
  CytonProtocol one({.channel = 1}, alone.sink(), alone.health);
  open_cyton(one, link);
  for (unsigned i = 0; i < 4; ++i) one.on_bytes(link, cyton_packet(i, 77, -40), kStart + i * milliseconds(4));
  ASSERT_FALSE(alone.blocks.empty());
  EXPECT_FALSE(alone.blocks[0].has_second);
  EXPECT_TRUE(alone.blocks[0].second_samples().empty());
}

}  // namespace
}  // namespace perimap
