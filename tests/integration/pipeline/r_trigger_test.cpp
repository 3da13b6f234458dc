// A session with an R trigger in the ECG's place, recorded and replayed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/evaluation/report/recorded_beats.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_recording.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "drivers/recording/sensor_writer.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

constexpr Duration kDelay = std::chrono::milliseconds(30);     // of the monitor
constexpr Duration kTransport = std::chrono::milliseconds(1);  // to us

struct Told {
  std::vector<double> coordinates, phases;
  perimap_PhaseState state = perimap_PHASE_UNKNOWN;
  std::uint64_t beats = 0, triggers = 0;
};

class Listener final : public Publication {
 public:
  explicit Listener(Told& told) : told_(told) {}
  void surface(const perimap_Surface& sample) override {
    for (std::uint32_t i = 0; i < sample.features._length; ++i) {
      for (const double mm : sample.features._buffer[i].position_W_mm) told_.coordinates.push_back(mm);
    }
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& phase) override {
    told_.phases.push_back(phase.cardiac_phase_rad);
    told_.state = phase.state;
    told_.beats = phase.beats;
  }
  void status(const perimap_Status& status) override {
    for (std::uint32_t i = 0; i < status.sources._length; ++i) {
      const perimap_SourceStatus& source = status.sources._buffer[i];
      if (source.kind == perimap_SOURCE_R_TRIGGER) told_.triggers = source.received;
    }
  }

 private:
  Told& told_;
};

class RTriggerReplay : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-trigger-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The simulated recording's frames and poses, and a pulse for each of its beats in place of the ECG's samples.
  std::string record() {
    const std::string file = (folder_ / "triggered.mcap").string();
    auto basis = recorded_basis(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
    EXPECT_TRUE(basis);
    basis->configuration.ecg.r_trigger = true;
    basis->configuration.ecg.r_trigger_port = "/dev/ttyS0";
    basis->configuration.ecg.r_trigger_delay = kDelay;
    const SensorRecordingFacts facts = recording_facts(basis->configuration, basis->camera, "test");
    std::vector<RPeak> beats = load_beats(PERIMAP_TEST_RECORDING, ReadMode::kStrict).value();
    auto reader = ReplayReader::open(PERIMAP_TEST_RECORDING, ReadMode::kStrict).value();
    auto event = reader.next().value();
    auto writer = SensorWriter::create(file, facts, arrival_of(*event)).value();
    const auto write_pulses_until = [&](Instant t) {
      while (pulses_ < beats.size() && beats[pulses_].time + kDelay + kTransport <= t) {
        const Instant edge = beats[pulses_].time + kDelay;
        const Instant arrival = edge + kTransport;
        EXPECT_TRUE(writer.write(RTriggerPulse{edge, arrival, static_cast<std::uint32_t>(++pulses_)}, arrival));
      }
    };
    for (; event; event = reader.next().value()) {
      const Instant arrival = arrival_of(*event);
      write_pulses_until(arrival);
      if (const auto* pose = std::get_if<TrackerSample>(&*event)) {
        EXPECT_TRUE(writer.write(*pose, arrival));
      }
      if (const auto* frame = std::get_if<FrameEvent>(&*event)) {
        CameraFrame as_it_came;
        as_it_came.stamp = frame->stamp;
        as_it_came.width = frame->width;
        as_it_came.height = frame->height;
        as_it_came.stride = static_cast<std::size_t>(frame->width);
        as_it_came.bytes = std::as_bytes(std::span(frame->pixels));
        EXPECT_TRUE(writer.write(as_it_came, arrival));
      }
    }
    EXPECT_TRUE(writer.finish());
    return file;
  }

  static Told replay(const std::string& file) {
    auto setup = prepare_replay(file, std::nullopt, ReadMode::kStrict);
    EXPECT_TRUE(setup) << setup.error().error.message;
    setup->pipeline.lockstep = true;
    Told told;
    Listener listener(told);
    Pipeline pipeline(setup->pipeline);
    LockstepRuntime runtime(pipeline, setup->identity, setup->utc_minus_monotonic, listener);
    for (auto event = setup->reader.next().value(); event; event = setup->reader.next().value()) {
      runtime.deliver(*event);
    }
    runtime.finish();
    return told;
  }

  std::filesystem::path folder_;
  std::size_t pulses_ = 0;
};

TEST_F(RTriggerReplay, LocksThePhaseByThePulsesAndGivesTheSameTwice) {
  const std::string file = record();
  ASSERT_GT(pulses_, 3U);
  const Told first = replay(file);
  EXPECT_EQ(first.triggers, pulses_);
  EXPECT_EQ(first.beats, pulses_);
  EXPECT_EQ(first.state, perimap_PHASE_LOCKED);
  EXPECT_GT(first.coordinates.size(), 100U) << "nothing was mapped";
  const Told second = replay(file);
  EXPECT_EQ(second.phases, first.phases);
  EXPECT_EQ(second.coordinates, first.coordinates);
}

TEST_F(RTriggerReplay, OfARecordingWithoutATriggerIsRefused) {
  const std::filesystem::path toml = folder_ / "trigger.toml";
  std::ofstream(toml) << "version = 1\n[ecg]\nr_trigger = true\n";
  const auto setup = prepare_replay(PERIMAP_TEST_RECORDING, toml, ReadMode::kStrict);
  ASSERT_FALSE(setup);
  EXPECT_TRUE(setup.error().configuration);
  EXPECT_THAT(setup.error().error.message,
              AllOf(HasSubstr("trigger.toml:3:13: key 'ecg.r_trigger'"), HasSubstr("holds no channel ecg/r_trigger")));
}

}  // namespace
}  // namespace perimap
