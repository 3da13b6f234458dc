// The respiration channel of an ECG device from its configuration into pipeline, status and recording.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "begun_recording.hpp"
#include "daemon/publishing/wire_status.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/standins/emulator/ecg_emulator.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

Configuration breathing_bitalino(const std::string& port) {
  Configuration configuration;
  configuration.ecg.protocol = EcgConfiguration::Protocol::kBitalino;
  configuration.ecg.port = port;
  configuration.respiration.channel = true;
  configuration.respiration.device_channel = 1;
  return configuration;
}

TEST(RespirationDevice, AChannelThatTheDeviceHasNotIsRefused) {
  Configuration configuration = breathing_bitalino("/dev/ttyUSB0");
  ASSERT_TRUE(named_devices(configuration, "perimap.toml"));
  configuration.respiration.device_channel = 8;
  const auto devices = named_devices(configuration, "perimap.toml");
  ASSERT_FALSE(devices);
  EXPECT_EQ(devices.error().front().key, "respiration.device_channel");
  EXPECT_THAT(devices.error().front().what, HasSubstr("expected 1 to 6 of a bitalino"));
}

TEST(RespirationFeeder, GivesTheChannelToPipelineStatusAndRecording) {
  const BegunRecording recording;
  const std::string port = recording.folder() + "/ecg";
  const Configuration configuration = breathing_bitalino(port);
  const SensorRecordingFacts facts = recording_facts(configuration, std::nullopt, "test");
  EXPECT_THAT(*facts.configuration, HasSubstr("\nchannel = true")) << "a replay listens to it too";
  EXPECT_THAT(*facts.configuration, ::testing::Not(HasSubstr("device_channel"))) << "a replay has no device";
  auto recorder = recording.begin(facts);
  ASSERT_TRUE(recorder);

  const Instant start = MonotonicClock::now();
  const auto emulated = emulate_bitalino(
      {SampledWaveform(start, 100.0, {0.0F, 0.5F}, true), SampledWaveform::breathing(seconds(2), start)}, {});
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
  // Three onsets agree on a period.
  EXPECT_TRUE(wait_until([&] { return entrance->breath().known(MonotonicClock::now()); })) << "no breath was heard";
  EXPECT_NEAR(to_seconds(entrance->breath().period), 2.0, 0.1);
  StatusFacts told;
  feeder.describe(told);
  EXPECT_TRUE(told.respiration_channel);
  EXPECT_FALSE(told.respiration_link.closed);
  feeder.stop();
  feeder.describe(told);
  EXPECT_TRUE(told.respiration_link.closed) << "it goes with the device";
  interrupt.request();
  emulating.join();

  EXPECT_EQ(counters.respiration_samples.get(), counters.ecg_samples.get());
  EXPECT_EQ(counters.respiration_off.get(), 0U);
  EXPECT_EQ(counters.last_respiration_ns.get(), counters.last_good_respiration_ns.get());
  WireStatus status(Identity{"test", ReleaseStream::kFrame, "tracker"});
  const perimap_Status& wire = status.fill(counters, told, MonotonicClock::now());
  const perimap_SourceStatus& source = wire.sources._buffer[wire.sources._length - 1];
  EXPECT_EQ(source.kind, perimap_SOURCE_RESPIRATION);
  EXPECT_EQ(source.received, counters.respiration_samples.get());

  auto reader = ReplayReader::open(recording.file(), ReadMode::kStrict);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->has_respiration());
  std::uint64_t samples = 0;
  for (auto event = reader->next().value(); event; event = reader->next().value()) {
    if (const auto* block = std::get_if<RespirationBlock>(&*event)) samples += block->count;
  }
  EXPECT_EQ(samples, counters.respiration_samples.get()) << "none is lost, none is added";
}

}  // namespace
}  // namespace perimap
