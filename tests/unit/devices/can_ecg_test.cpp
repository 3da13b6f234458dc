// Bytes to stamped samples: an ECG on a CAN bus.
#include "ecg_decoding.hpp"

namespace perimap {
namespace {

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
