// A trigger line from its configuration into pipeline, status and recording.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "begun_recording.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

// A line that goes on and off while its port is plugged in.
class BeatingPort final : public ModemPort {
 public:
  explicit BeatingPort(const std::atomic<bool>& plugged) : plugged_(plugged) {}
  Expected<bool> wait_for_change() override {
    std::this_thread::sleep_for(milliseconds(3));
    if (!plugged_.load()) return fail("unplugged");
    ++line_.changes;
    line_.on = !line_.on;
    return true;
  }
  Expected<Line> read() override { return line_; }

 private:
  const std::atomic<bool>& plugged_;
  Line line_;
};

EcgConfiguration triggered() {
  EcgConfiguration ecg;
  ecg.r_trigger = true;
  ecg.r_trigger_port = "/dev/ttyS4";
  ecg.r_trigger_line = ModemLine::kClearToSend;
  ecg.r_trigger_rising = false;
  return ecg;
}

TEST(RTriggerDevice, IsAsTheConfigurationNamesIt) {
  Configuration configuration;
  EXPECT_FALSE(names_devices(configuration));
  configuration.ecg = triggered();
  EXPECT_TRUE(names_devices(configuration));
  const auto devices = named_devices(configuration, "perimap.toml");
  ASSERT_TRUE(devices) << devices.error().front().what;
  ASSERT_TRUE(devices->r_trigger);
  EXPECT_FALSE(devices->ecg) << "a trigger needs no ECG device";
  EXPECT_EQ(devices->r_trigger->settings.path, "/dev/ttyS4");
  EXPECT_EQ(devices->r_trigger->settings.line, ModemLine::kClearToSend);
  EXPECT_FALSE(devices->r_trigger->settings.rising);
}

TEST(RTriggerDevice, WithoutAPortSaysWhichKeyIsMissing) {
  Configuration configuration;
  configuration.ecg = triggered();
  configuration.ecg.r_trigger_port.reset();
  const auto devices = named_devices(configuration, "perimap.toml");
  ASSERT_FALSE(devices);
  ASSERT_EQ(devices.error().size(), 1U);
  EXPECT_EQ(devices.error().front().key, "ecg.r_trigger_port");
  EXPECT_THAT(devices.error().front().what, HasSubstr("expected the serial port"));
}

// Plugged in, unplugged and plugged in again.
TEST(RTriggerFeeder, GivesThePulsesToPipelineStatusAndRecording) {
  const BegunRecording recording;
  Configuration configuration;
  configuration.ecg = triggered();
  configuration.ecg.r_trigger_delay = milliseconds(35);
  const SensorRecordingFacts facts = recording_facts(configuration, std::nullopt, "test");
  EXPECT_THAT(*facts.configuration, HasSubstr("\nr_trigger = true"));
  EXPECT_THAT(*facts.configuration, HasSubstr("\nr_trigger_delay_ms = 35.0"));
  EXPECT_THAT(*facts.configuration, ::testing::Not(HasSubstr("ttyS4"))) << "a replay has no port";
  auto recorder = recording.begin(facts);
  ASSERT_TRUE(recorder);

  std::atomic<bool> plugged{true};
  Devices devices;
  devices.r_trigger = r_trigger_device(configuration.ecg).value();
  devices.r_trigger->settings.shortest_interval = Duration(0);
  devices.r_trigger->open = [&plugged](const std::string& path,
                                       ModemLine line) -> Expected<std::unique_ptr<ModemPort>> {
    EXPECT_EQ(path, "/dev/ttyS4");
    EXPECT_EQ(line, ModemLine::kClearToSend);
    if (!plugged.load()) return fail("no such device");
    return std::make_unique<BeatingPort>(plugged);
  };
  PipelineCounters counters;
  const auto entrance = std::make_unique<SensorEntrance>(
      4, 4, EcgIntakeSettings{{}, RTriggerSettings{milliseconds(35)}}, BreathDetectorSettings{}, counters);
  DeviceFeeder feeder(std::move(devices), entrance.get(), {std::move(recorder), nullptr});
  ThreadLauncher threads{SchedulingSettings{}};
  feeder.start(threads);
  const auto closed = [&feeder] {
    StatusFacts told;
    feeder.describe(told);
    EXPECT_FALSE(told.ecg_device);
    return told.r_trigger_line.closed;
  };
  EXPECT_TRUE(wait_until([&] { return counters.r_triggers.get() >= 5 && !closed(); }));
  plugged = false;
  EXPECT_TRUE(wait_until(closed));
  const std::uint64_t before = counters.r_triggers.get();
  plugged = true;
  EXPECT_TRUE(wait_until([&] { return counters.r_triggers.get() >= before + 5; }));
  EXPECT_FALSE(closed());
  feeder.stop();

  EXPECT_EQ(counters.r_triggers_dropped.get(), 0U);
  auto reader = ReplayReader::open(recording.file(), ReadMode::kStrict);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_TRUE(reader->has_r_trigger());
  std::vector<RTriggerPulse> pulses;
  for (auto event = reader->next().value(); event; event = reader->next().value()) {
    if (const auto* pulse = std::get_if<RTriggerPulse>(&*event)) pulses.push_back(*pulse);
  }
  ASSERT_EQ(pulses.size(), counters.r_triggers.get()) << "none is lost, none is added";
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    EXPECT_EQ(pulses[i].device_count, i + 1);
    EXPECT_LE(pulses[i].time, pulses[i].arrival);
    if (i > 0) {
      EXPECT_GT(pulses[i].time, pulses[i - 1].time);
    }
  }
  EXPECT_EQ(static_cast<std::uint64_t>(to_ns(pulses.back().time)), counters.last_r_trigger_ns.get());
}

}  // namespace
}  // namespace perimap
