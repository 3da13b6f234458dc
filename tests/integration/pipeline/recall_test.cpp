// A map that was kept is gone on with, and one that was to be forgotten is gone.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/law_choice.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "daemon/checkpoint/checkpoint_keeper.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "daemon/runtime/session_commands.hpp"
#include "tests/integration/pipeline/kept_map.hpp"

namespace perimap {
namespace {

using test::KeptMap;

struct Unheard final : Publication {
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

ReplaySetup setup(Precision precision) {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  made->pipeline.lockstep = true;
  // Few enough that every slot is kept once a second: the recording ends soon after the first are mapped.
  made->pipeline.features.maximum = 40;
  made->pipeline.estimator.precision = precision;
  return std::move(*made);
}

// A run over the whole recording.
struct EarlierRun {
  explicit EarlierRun(Precision precision = Precision::kDouble)
      : s(setup(precision)), pipeline(s.pipeline), runtime(pipeline, s.identity, s.utc_minus_monotonic, unheard) {
    KeptMap kept;
    while (auto event = next()) {
      runtime.deliver(*event);
      kept.take(pipeline);
    }
    memory = kept.memory(pipeline.counters());
  }
  std::optional<ReplayEvent> next() {
    auto event = s.reader.next();
    if (!event) throw std::runtime_error(event.error().message);
    return std::move(*event);
  }

  ReplaySetup s;
  Unheard unheard;
  Pipeline pipeline;
  LockstepRuntime runtime;
  MapMemory memory;
};

// What the map says without any frame: where each feature is at the release.
std::map<std::uint32_t, SurfaceFeature> surface_at(Pipeline& pipeline, const Release& release) {
  std::map<std::uint32_t, SurfaceFeature> surface;
  for (const SurfaceFeature& feature : pipeline.compose(release).features) surface[feature.id] = feature;
  return surface;
}

TEST(Recall, PublishesWhatTheEarlierRunWouldHave) {
  EarlierRun earlier;
  ASSERT_GT(earlier.memory.features.size(), 5U) << "the recording must have mapped some";
  Pipeline later(earlier.s.pipeline);
  const Instant now = earlier.memory.last_capture + earlier.s.pipeline.latency + std::chrono::milliseconds(400);
  later.recall(earlier.memory, now);
  const auto release = later.plan().next();
  ASSERT_TRUE(release);
  EXPECT_TRUE(release->frame_missing);
  EXPECT_GT(release->deadline, now) << "the releases that were missed are not made up for";
  EXPECT_LE(release->deadline, now + earlier.memory.frame_period);
  EXPECT_EQ(release->frame_sequence, 0U) << "a number of the earlier run is none of this one";

  const auto before = surface_at(earlier.pipeline, *release);
  const auto after = surface_at(later, *release);
  int compared = 0;
  for (const FeatureMemory& feature : earlier.memory.features) {
    ASSERT_TRUE(after.contains(feature.id));
    const SurfaceFeature& there = after.at(feature.id);
    EXPECT_NE(there.state, FeatureState::kInvalid) << "the phase is known again";
    if (!before.contains(feature.id)) continue;
    // The map went on learning after the feature was last taken; the phase is the same, from the same beats.
    EXPECT_LT((there.p_WF_mm - before.at(feature.id).p_WF_mm).norm(), 3.0);
    EXPECT_TRUE(there.covariance_W_mm2.allFinite());
    EXPECT_GT(there.covariance_W_mm2.trace(), 0.0);
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

// The numbers that are kept are double in either.
TEST(Recall, AMapOfOnePrecisionIsGoneOnWithInTheOther) {
  for (const auto& [then, now] :
       {std::pair(Precision::kDouble, Precision::kSingle), std::pair(Precision::kSingle, Precision::kDouble)}) {
    EarlierRun earlier(then);
    ASSERT_GT(earlier.memory.features.size(), 5U);
    const Release release{1'000'000, earlier.memory.last_capture,
                          earlier.memory.last_capture + earlier.s.pipeline.latency, true};
    PipelineSettings settings = earlier.s.pipeline;
    const auto surface = [&](Precision precision) {
      settings.estimator.precision = precision;
      Pipeline later(settings);
      later.recall(earlier.memory, earlier.memory.last_capture);
      return surface_at(later, release);
    };
    const auto same = surface(then);
    const auto other = surface(now);
    ASSERT_EQ(same.size(), earlier.memory.features.size());
    ASSERT_EQ(other.size(), same.size());
    for (const auto& [id, feature] : same) {
      ASSERT_TRUE(other.contains(id));
      EXPECT_EQ(other.at(id).state, feature.state);
      EXPECT_LT((other.at(id).p_WF_mm - feature.p_WF_mm).norm(), 1e-3);
    }
  }
}

TEST(Recall, ForgettingLeavesNothingOfMapAndRhythm) {
  EarlierRun run;
  Release release{1'000'000, run.memory.last_capture, run.memory.last_capture + run.s.pipeline.latency, true};
  ASSERT_FALSE(surface_at(run.pipeline, release).empty());
  run.pipeline.ask_to_forget();
  run.pipeline.forget_if_asked();
  EXPECT_TRUE(surface_at(run.pipeline, release).empty());
  EXPECT_EQ(run.pipeline.counters().maps_forgotten.get(), 1U);
  for (const FeatureSlot& slot : run.pipeline.slots()) {
    EXPECT_TRUE(slot.state == SlotState::kEmpty || (slot.state == SlotState::kStarting && slot.forgotten));
  }
  EcgBlock block = run.memory.ecg.back();
  block.first_sample_time += block.count * block.sample_period;
  run.pipeline.entrance().push_ecg(block);
  EXPECT_EQ(run.pipeline.status_clock(block.first_sample_time).beats(), 0U);
}

// What was made of the law that the old patient's heart moves by goes with the map.
TEST(Recall, ForgettingLeavesNothingOfTheLaw) {
  EarlierRun run;
  const Instant now = run.memory.last_capture;
  const std::array<double, kPhaseLaws.size()> unknown = LawChoice().belief().probabilities;
  ASSERT_NE(run.pipeline.status_clock(now).law_belief().probabilities, unknown) << "beats must have been weighed";
  run.pipeline.ask_to_forget();
  run.pipeline.forget_if_asked();
  EXPECT_EQ(run.pipeline.status_clock(now).law_belief().probabilities, unknown);
}

// A run that is over, whose checkpoint is still kept by a thread that runs.
class KeptRun : public ::testing::Test {
 protected:
  KeptRun() {
    keeping_ = std::thread([this] { keeper.run(); });
    while (auto event = run_.reader.next()) {
      if (!*event) break;
      runtime_.deliver(**event);
    }
  }
  ~KeptRun() override {
    keeper.stop();
    keeping_.join();
    std::filesystem::remove(file);
  }
  // What has to become so does so before long, or never.
  template <class Condition>
  [[nodiscard]] static bool comes_true(Condition condition) {
    for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
  }
  [[nodiscard]] bool kept() const { return std::filesystem::exists(file); }

 private:
  ReplaySetup run_ = setup(Precision::kDouble);
  Unheard unheard_;
  std::thread keeping_;

 protected:
  static constexpr Duration kInterval = std::chrono::milliseconds(20);

  std::filesystem::path file = testing::TempDir() + "/perimap_kept_run_" + std::to_string(::getpid());
  Pipeline pipeline{run_.pipeline};
  CheckpointKeeper keeper{pipeline, file, perimap::SetUp{}, kInterval};

 private:
  LockstepRuntime runtime_{pipeline, run_.identity, run_.utc_minus_monotonic, unheard_};
};

TEST_F(KeptRun, WhenTheMapIsForgottenItsCheckpointGoesToo) {
  ASSERT_TRUE(comes_true([this] { return kept(); }));
  pipeline.ask_to_forget();
  pipeline.forget_if_asked();
  EXPECT_TRUE(comes_true([this] { return !kept(); }));
}

TEST_F(KeptRun, TheCheckpointGoesThoughTheMapperDoesNotAnswerTheCommand) {
  ASSERT_TRUE(comes_true([this] { return kept(); }));
  SessionCommands commands(
      pipeline, {}, [] { return StatusFacts{}; }, [] { return std::string(); }, [](bool) { return std::string(); },
      [this](std::uint64_t before) { keeper.forget(before); });
  EXPECT_FALSE(commands.answer(ControlCommand::kNewPatient)) << "nothing maps here";
  EXPECT_FALSE(kept());
  std::this_thread::sleep_for(10 * kInterval);
  EXPECT_FALSE(kept()) << "nothing of the old map is written again";
  pipeline.forget_if_asked();
  std::this_thread::sleep_for(10 * kInterval);
  EXPECT_FALSE(kept());
}

TEST(Recall, TakesNoMoreFeaturesThanThereIsRoomForAndNoneOfAnotherLayout) {
  EarlierRun run;
  ASSERT_GT(run.memory.features.size(), 5U);
  run.memory.features[0].estimate.x.resize(3);
  run.memory.features[0].estimate.P.resize(3, 3);
  PipelineSettings settings = run.s.pipeline;
  settings.features.maximum = 4;
  Pipeline small(settings);
  small.recall(run.memory, run.memory.last_capture);
  int mapped = 0;
  for (const FeatureSlot& slot : small.slots()) {
    if (slot.state != SlotState::kMapped) continue;
    ++mapped;
    EXPECT_NE(slot.id, run.memory.features[0].id);
  }
  EXPECT_EQ(mapped, 4);
}

// The numbers of what a run finds that goes on from this memory at `now`, with the recording from then on.
std::set<std::uint32_t> found_from(const MapMemory& memory, Instant now) {
  ReplaySetup s = setup(Precision::kDouble);
  Pipeline pipeline(s.pipeline);
  pipeline.recall(memory, now);
  Unheard unheard;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, unheard);
  std::optional<Duration> offset;
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) {
    if (!offset) offset = now - arrival_of(**event);
    shift(**event, *offset);
    runtime.deliver(**event);
  }
  runtime.finish();
  std::set<std::uint32_t> ids;
  for (const FeatureSlot& slot : pipeline.slots()) {
    if (slot.state != SlotState::kEmpty && slot.id != memory.features[0].id) ids.insert(slot.id);
  }
  return ids;
}

// The first was killed before anything was kept.
TEST(Recall, TwoRunsThatGoOnFromTheSameMemoryGiveNoNumberTwice) {
  EarlierRun earlier;
  ASSERT_GT(earlier.memory.features.size(), 5U);
  earlier.memory.features.resize(1);
  const Instant kept = earlier.memory.last_capture;
  const std::set<std::uint32_t> first = found_from(earlier.memory, kept + std::chrono::seconds(1));
  const std::set<std::uint32_t> second = found_from(earlier.memory, kept + std::chrono::seconds(9));
  ASSERT_FALSE(first.empty());
  ASSERT_FALSE(second.empty());
  for (const std::uint32_t id : second) EXPECT_FALSE(first.contains(id)) << id;
}

// Two features as of before a crash, over the recording's ECG: one with breathing, one kept before it was found.
struct BreathingMemory {
  BreathingMemory() : settings(earlier.s.pipeline), memory(earlier.memory) {
    settings.respiration.enabled = true;
    settings.estimator.layout.respiratory_harmonics = kBreathHarmonics;
    const BasisLayout& layout = settings.estimator.layout;
    FeatureMemory feature = memory.features.front();
    feature.converged = true;
    feature.largest_deviation_mm = 0.5;
    feature.estimate = prior_estimate(layout, {}, {10.0, -20.0, 150.0});
    feature.estimate.P *= 1e-4;
    feature.id = 1;
    memory.features = {feature, feature};
    memory.features[1].id = 2;
    memory.features[0].breathing = true;
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 2 * kBreathHarmonics; ++k) {
        const int i = axis * layout.size() + 1 + 2 * layout.cardiac_harmonics + k;
        memory.features[0].estimate.x(i) = 1.0 + axis - 0.5 * k;
      }
    }
    RespirationMemory& breath = memory.respiration;
    breath.found = true;
    breath.wave.a[0] = {0.0, 2.0, -4.0};
    breath.wave.b[1] = {0.5, 0.0, 1.0};
    breath.clock.state = RespirationState::kLocked;
    breath.clock.time = memory.last_capture;
    breath.clock.phase_rad = 0.5;
    breath.clock.rate_rad_per_s = 1.5;
    breath.clock.phase_variance_rad2 = 1e-4;
    breath.clock.rate_variance_rad2_per_s2 = 1e-5;
  }
  [[nodiscard]] Release release(Duration since) const {
    const Instant capture = memory.last_capture + since;
    return {1'000'000, capture, capture + settings.latency, true};
  }

  EarlierRun earlier;
  PipelineSettings settings;
  MapMemory memory;
};

TEST(Recall, BreathingGoesOnInThePhaseThatTheMapCountsFrom) {
  using std::chrono::milliseconds;
  const BreathingMemory before;
  const BasisLayout& layout = before.settings.estimator.layout;
  Pipeline later(before.settings);
  later.recall(before.memory, before.memory.last_capture + milliseconds(400));
  EXPECT_EQ(later.status_respiration().state, RespirationState::kLocked);
  double last_trace_mm2 = 0.0;
  for (const Duration since : {milliseconds(450), milliseconds(1450), milliseconds(2450)}) {
    const SurfaceSample& sample = later.compose(before.release(since));
    ASSERT_EQ(sample.features.size(), 2U);
    const double phase_rad = 0.5 + 1.5 * to_seconds(sample.valid_time - before.memory.respiration.clock.time);
    const SurfaceFeature& breathing = sample.features[0];
    EXPECT_NE(sample.reason, SurfaceReason::kRespirationUnknown);
    const Vector3d expected =
        position_of(before.memory.features[0].estimate.x, basis_at(layout, sample.cardiac_phase_rad, phase_rad));
    EXPECT_LT((breathing.p_WF_mm - expected).norm(), 1e-9);
    // What was not there when it was kept is what all have in common.
    const Vector3d still =
        position_of(before.memory.features[1].estimate.x, basis_without_breath(layout, sample.cardiac_phase_rad));
    EXPECT_LT((sample.features[1].p_WF_mm - still - before.memory.respiration.wave.at(phase_rad)).norm(), 1e-9);
    EXPECT_GT(breathing.covariance_W_mm2.trace(), last_trace_mm2) << "the phase becomes less certain";
    last_trace_mm2 = breathing.covariance_W_mm2.trace();
  }
}

TEST(Recall, WhereTheBreathsPhaseIsNotKnownAnyMoreItIsSaidSo) {
  BreathingMemory before;
  before.memory.respiration.clock.state = RespirationState::kSearching;
  Pipeline later(before.settings);
  later.recall(before.memory, before.memory.last_capture);
  const SurfaceSample& sample = later.compose(before.release(std::chrono::milliseconds(40)));
  EXPECT_EQ(sample.reason, SurfaceReason::kRespirationUnknown);
  const double displacement_mm = before.settings.respiration.displacement_mm;
  for (const SurfaceFeature& feature : sample.features) {
    EXPECT_NE(feature.state, FeatureState::kConverged);
    EXPECT_GT(feature.covariance_W_mm2.trace(), 3.0 * displacement_mm * displacement_mm);
  }
}

TEST(Recall, WhatIsRecalledIsHeldToWhatWasBelievedOfTheSetUp) {
  EarlierRun earlier;
  ASSERT_GT(earlier.memory.features.size(), 5U);
  for (FeatureMemory& feature : earlier.memory.features) {
    feature.converged = true;
    feature.largest_deviation_mm = 0.5;
  }
  const Release release{1'000'000, earlier.memory.last_capture,
                        earlier.memory.last_capture + earlier.s.pipeline.latency, true};
  const auto converged = [&](const SetupMemory& setup) {
    earlier.memory.setup = setup;
    Pipeline later(earlier.s.pipeline);
    later.recall(earlier.memory, earlier.memory.last_capture);
    std::size_t count = 0;
    for (const auto& [id, feature] : surface_at(later, release)) {
      count += feature.state == FeatureState::kConverged ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(converged({}), 0U) << "nothing had told of the set-up";
  SetupMemory setup;
  setup.asked = true;
  EXPECT_EQ(converged(setup), earlier.memory.features.size());
  setup.widening_mm = 0.95;
  EXPECT_EQ(converged(setup), 0U) << "with that they are beyond the bound";
  setup = {};
  setup.asked = setup.doubted = true;
  setup.told.state = SetupState::kDoubted;
  EXPECT_EQ(converged(setup), 0U);
}

}  // namespace
}  // namespace perimap
