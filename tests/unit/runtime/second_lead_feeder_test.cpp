// The second lead of an emulated ECG device from its input into pipeline and recording.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <thread>

#include "begun_recording.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/standins/emulator/ecg_emulator.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using Protocol = EcgConfiguration::Protocol;
using std::chrono::seconds;

struct Inputs {
  Protocol protocol;
  int second_channel;
  int respiration_channel;  // 0: none
};

class SecondLeadFeeder : public ::testing::TestWithParam<Inputs> {};

// The emulated second lead is the first one turned over; a BITalino tells 0.003 mV from each other.
TEST_P(SecondLeadFeeder, GivesBothLeadsToPipelineAndRecording) {
  const Inputs inputs = GetParam();
  const BegunRecording recording;
  const std::string port = recording.folder() + "/ecg";
  Configuration configuration;
  configuration.ecg.protocol = inputs.protocol;
  configuration.ecg.port = port;
  configuration.ecg.second_channel = inputs.second_channel;
  configuration.respiration.channel = inputs.respiration_channel > 0;
  configuration.respiration.device_channel = inputs.respiration_channel;
  auto recorder = recording.begin(recording_facts(configuration, std::nullopt, "test"));
  ASSERT_TRUE(recorder);

  const Instant start = MonotonicClock::now();
  EcgDeviceSignals signals{SampledWaveform(start, 20.0, {0.0F, 0.8F, 0.3F}, true),
                           SampledWaveform::breathing(seconds(2), start)};
  signals.second_mV = signals.ecg_mV.seen_elsewhere(-0.6F, Duration(0));
  const auto emulated = inputs.protocol == Protocol::kBitalino ? emulate_bitalino(std::move(signals), {})
                                                               : emulate_cyton(std::move(signals), {});
  Interrupt interrupt;
  std::jthread emulating([&] {
    const auto done = emulate_on_terminal(
        port, *emulated, {}, [](const std::string&) {}, interrupt);
    EXPECT_TRUE(done) << done.error().message;
  });
  auto devices = named_devices(configuration, "perimap.toml");
  ASSERT_TRUE(devices) << devices.error().front().what;
  PipelineCounters counters;
  const auto entrance = std::make_unique<SensorEntrance>(4, 4, EcgIntakeSettings{}, BreathDetectorSettings{}, counters);
  DeviceFeeder feeder(std::move(*devices), entrance.get(), {std::move(recorder), nullptr});
  ThreadLauncher threads{SchedulingSettings{}};
  feeder.start(threads);
  EXPECT_TRUE(wait_until([&] { return counters.ecg_samples.get() > 500; })) << "nothing was heard";
  feeder.stop();
  interrupt.request();
  emulating.join();
  EXPECT_GT(counters.ecg_leads[1].get(), 0U) << "the second lead is told of";
  EXPECT_EQ(counters.ecg_lead_off.get(), 0U);
  if (inputs.respiration_channel > 0) {
    EXPECT_EQ(counters.respiration_samples.get(), counters.ecg_samples.get());
  }

  auto reader = ReplayReader::open(recording.file(), ReadMode::kStrict);
  ASSERT_TRUE(reader) << reader.error().message;
  std::uint64_t samples = 0;
  for (auto event = reader->next().value(); event; event = reader->next().value()) {
    const auto* block = std::get_if<EcgBlock>(&*event);
    if (block == nullptr) continue;
    ASSERT_TRUE(block->has_second);
    for (std::size_t i = 0; i < block->count; ++i) ASSERT_NEAR(block->second_mV[i], -0.6F * block->mV[i], 0.004F);
    samples += block->count;
  }
  EXPECT_EQ(samples, counters.ecg_samples.get());
}

INSTANTIATE_TEST_SUITE_P(Devices, SecondLeadFeeder,
                         ::testing::Values(Inputs{Protocol::kBitalino, 3, 0}, Inputs{Protocol::kBitalino, 3, 1},
                                           Inputs{Protocol::kBitalino, 3, 4}, Inputs{Protocol::kCyton, 2, 5}));

}  // namespace
}  // namespace perimap
