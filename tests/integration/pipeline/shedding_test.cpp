// Features are shed when the budget does not suffice, and that is said. The budget is the shortest there is, so that
// any machine overruns it.
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "core/pipeline/load_shedding.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"
#include "tests/integration/pipeline/kept_map.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::CollectedSurface;
using test::CollectedSurfaces;

struct Shed {
  std::uint64_t most = 0;  // at any time
  std::uint64_t most_tracked = 0;
  std::uint64_t times = 0;
  std::vector<CollectedSurface> surfaces;
};

ReplaySetup setup(bool shedding) {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  made->pipeline.budget = std::chrono::microseconds(100);
  made->pipeline.shedding = shedding;
  return std::move(*made);
}

// The live pipeline, given the recording's frames so slowly that a busy machine too finds features in time.
Shed paced(bool shedding) {
  ReplaySetup s = setup(shedding);
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  const PipelineCounters& counters = pipeline.counters();
  Shed shed;
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) {
    runtime.deliver(**event);
    if (!std::holds_alternative<FrameEvent>(**event)) continue;
    std::this_thread::sleep_for(milliseconds(40));
    shed.most = std::max(shed.most, counters.features_shed.get());
    shed.most_tracked = std::max(shed.most_tracked, counters.features_tracked.get());
  }
  runtime.finish();
  shed.times = counters.times_shed.get();
  shed.surfaces = collected.of(ReleaseStream::kFrame);
  return shed;
}

TEST(LoadSheddingLive, IsReportedAndTheSurfacesGoOn) {
  const Shed shed = paced(true);
  if (shed.most_tracked <= LoadSheddingDecision::kLeast) GTEST_SKIP() << "too busy a machine: no features were found";
  EXPECT_GT(shed.times, 0U);
  EXPECT_GT(shed.most, 0U);
  ASSERT_GT(shed.surfaces.size(), 100U);
  for (std::size_t i = 0; i < shed.surfaces.size(); ++i) EXPECT_EQ(shed.surfaces[i].head.sample_sequence, i + 1);
}

// ---- shed, and taken back

constexpr Duration kHeldUp = milliseconds(150);
constexpr Duration kBudget = milliseconds(100);
constexpr int kMostHeldUp = 60;  // frames
// The recording's events, moved so that the first one arrives at `begin`.
class MovedEvents {
 public:
  MovedEvents(ReplayReader& reader, Instant begin) : reader_(reader), begin_(begin) {}

  std::optional<ReplayEvent> next() {
    auto event = reader_.next();
    if (!event) throw std::runtime_error(event.error().message);
    if (!*event) return std::nullopt;
    if (!offset_) offset_ = begin_ - arrival_of(**event);
    shift(**event, *offset_);
    return std::move(*event);
  }

 private:
  ReplayReader& reader_;
  Instant begin_;
  std::optional<Duration> offset_;
};

struct Unheard final : Publication {
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
};

std::set<pid_t> threads_of_this_process() {
  std::set<pid_t> ids;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    ids.insert(static_cast<pid_t>(std::stol(task.path().filename().string())));
  }
  return ids;
}

// The last surface has a feature that is shed. One without a map is shed before, and is on no surface.
bool any_says_so(const CollectedSurfaces& collected) {
  const std::vector<CollectedSurface> surfaces = collected.of(ReleaseStream::kFrame);
  if (surfaces.empty()) return false;
  const std::vector<perimap_SurfaceFeature>& features = surfaces.back().features;
  return std::any_of(features.begin(), features.end(),
                     [](const perimap_SurfaceFeature& f) { return f.reason == perimap_FEATURE_REASON_SHED; });
}

void sleep_in_handler(int /*signal*/) {
  const int before = errno;
  timespec left{0, std::chrono::nanoseconds(kHeldUp).count()};
  while (nanosleep(&left, &left) != 0) {
  }
  errno = before;
}

// The recording once to make a map, then once more with that map, live. The first frames of the second time are held up
// beyond the budget: each worker is made to sleep when the frame comes. The others take what they take.
TEST(LoadSheddingLive, FeaturesAreShedWhileFramesAreHeldUpAndTakenBackAfterwards) {
  ReplaySetup first = setup(false);
  first.pipeline.lockstep = true;
  first.pipeline.features.maximum = 40;
  // So far in this machine's future that learning is never put off: the next frame's time is still to come.
  const Instant begin = MonotonicClock::now() + std::chrono::hours(1);
  test::KeptMap kept;
  Instant ecg_end;
  std::optional<Instant> ecg_begin;
  MapMemory memory;
  {
    Pipeline pipeline(first.pipeline);
    Unheard unheard;
    LockstepRuntime runtime(pipeline, first.identity, first.utc_minus_monotonic, unheard);
    MovedEvents events(first.reader, begin);
    while (const auto event = events.next()) {
      if (const auto* ecg = std::get_if<EcgBlock>(&*event)) {
        if (!ecg_begin) ecg_begin = ecg->first_sample_time;
        ecg_end = ecg->first_sample_time + ecg->count * ecg->sample_period;
      }
      runtime.deliver(*event);
      kept.take(pipeline);
    }
    memory = kept.memory(pipeline.counters());
  }
  ASSERT_GT(memory.features.size(), 2U * LoadSheddingDecision::kLeast) << "the recording must have mapped some";
  ASSERT_TRUE(ecg_begin);

  ReplaySetup s = setup(true);
  s.pipeline.features.maximum = 40;
  s.pipeline.budget = kBudget;
  Pipeline pipeline(s.pipeline);
  pipeline.recall(memory, memory.last_capture);
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = &sleep_in_handler;
  ASSERT_EQ(sigaction(SIGUSR1, &action, &before), 0);
  const std::set<pid_t> others = threads_of_this_process();
  CollectedSurfaces collected;
  std::uint64_t most = 0;
  std::uint64_t least_after = memory.features.size();
  Duration longest_after{0};
  {
    LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
    std::set<pid_t> threads = threads_of_this_process();
    for (const pid_t other : others) threads.erase(other);
    const PipelineCounters& counters = pipeline.counters();
    int frames = 0;
    int held_up = 0;
    MovedEvents events(s.reader, begin + (ecg_end - *ecg_begin));
    while (const auto event = events.next()) {
      const bool is_frame = std::holds_alternative<FrameEvent>(*event);
      if (is_frame && ++frames <= kMostHeldUp && !any_says_so(collected)) {
        held_up = frames;
        // What the workers learn from the frame before is no part of this one's time.
        std::this_thread::sleep_for(milliseconds(20));
        for (const pid_t thread : threads) ::syscall(SYS_tgkill, ::getpid(), thread, SIGUSR1);
      }
      const Instant begun = MonotonicClock::now();
      runtime.deliver(*event);
      most = std::max(most, counters.features_shed.get());
      if (frames <= held_up + 2) continue;
      longest_after = std::max(longest_after, MonotonicClock::now() - begun);
      least_after = std::min(least_after, counters.features_shed.get());
    }
    runtime.finish();
  }
  ASSERT_EQ(sigaction(SIGUSR1, &before, nullptr), 0);

  EXPECT_GT(most, 0U);
  std::set<std::uint32_t> shed;
  std::set<std::uint32_t> taken_back;
  for (const CollectedSurface& surface : collected.of(ReleaseStream::kFrame)) {
    for (const perimap_SurfaceFeature& f : surface.features) {
      if (f.reason == perimap_FEATURE_REASON_SHED) {
        shed.insert(f.id);
      } else if (shed.contains(f.id)) {
        taken_back.insert(f.id);
      }
    }
  }
  EXPECT_FALSE(shed.empty()) << "a shed feature says so";
  if (to_seconds(longest_after) > LoadSheddingDecision::kCalmShare * to_seconds(kBudget)) {
    GTEST_SKIP() << "too busy a machine: a frame took " << to_seconds(longest_after) << " s";
  }
  EXPECT_LT(least_after, most);
  EXPECT_FALSE(taken_back.empty());
}

TEST(LoadSheddingLive, IsOffWhenConfiguredSo) {
  const Shed shed = paced(false);
  EXPECT_EQ(shed.times, 0U);
  EXPECT_EQ(shed.most, 0U);
}

TEST(LoadSheddingLive, IsOffInLockstep) {
  ReplaySetup s = setup(true);
  s.pipeline.lockstep = true;
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) runtime.deliver(**event);
  runtime.finish();
  EXPECT_EQ(pipeline.counters().times_shed.get(), 0U);
  for (const CollectedSurface& surface : collected.of(ReleaseStream::kFrame)) {
    for (const perimap_SurfaceFeature& f : surface.features) EXPECT_NE(f.reason, perimap_FEATURE_REASON_SHED);
  }
}

}  // namespace
}  // namespace perimap
