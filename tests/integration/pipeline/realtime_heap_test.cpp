// The real-time path makes no heap call, takes no lock, waits for nothing but at its named waits, and does no input or
// output. The calls of forbidden_calls.hpp are interposed for the whole process, and those inside a RealtimeScope are
// counted. Not built with sanitizers, which bring their own allocator.
#include <gtest/gtest.h>
#include <linux/futex.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/setup_watcher.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "core/realtime/wakeup.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "tests/integration/pipeline/forbidden_calls.hpp"

namespace perimap {
namespace {

using test::forbidden_calls;
using test::ForbiddenCalls;
using test::forget_forbidden_calls;

struct LastSurface final : Publication {
  void surface(const perimap_Surface& sample) override {
    if (sample.stream == name_of(ReleaseStream::kClock)) {
      ++clock_surfaces;
      return;
    }
    ++surfaces;
    features = sample.features._length;
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  int surfaces = 0;
  int clock_surfaces = 0;
  std::uint32_t features = 0;
};

void expect_none() {
  const ForbiddenCalls calls = forbidden_calls();
  EXPECT_EQ(calls.heap, 0);
  EXPECT_EQ(calls.blocking, 0) << calls.first_blocking;
}

ReplaySetup setup(const char* recording = PERIMAP_TEST_RECORDING) {
  auto made = prepare_replay(recording, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  return std::move(*made);
}

TEST(RealtimePath, TheCounterSeesAHeapCallInsideTheScopeAndOnlyThere) {
  forget_forbidden_calls();
  std::unique_ptr<std::vector<int>> outside = std::make_unique<std::vector<int>>(1000);
  EXPECT_EQ(forbidden_calls().heap, 0);
  {
    const RealtimeScope realtime;
    outside->resize(100'000);
  }
  EXPECT_GT(forbidden_calls().heap, 0);
}

struct BlockingCall {
  std::string name;  // as it is counted
  std::function<void()> call;
};

// None of them waits for long.
std::vector<BlockingCall> blocking_calls() {
  static std::mutex mutex;
  static std::mutex held;
  [[maybe_unused]] static const bool is_held = (held.lock(), true);
  static pthread_cond_t condition = PTHREAD_COND_INITIALIZER;
  static const std::timespec long_ago{1, 0};
  static const std::timespec at_once{0, 1};
  static Wakeup wakeup;
  static std::atomic<int> word{0};
  static std::byte byte{};
  return {
      {"pthread_mutex_lock", [] { const std::lock_guard lock(mutex); }},
      {"pthread_cond_timedwait",
       [] { static_cast<void>(pthread_cond_timedwait(&condition, held.native_handle(), &long_ago)); }},
      {"sem_wait",
       [] {
         wakeup.post();
         wakeup.wait();
       }},
      {"sem_clockwait", [] { static_cast<void>(wakeup.wait_until(Instant{})); }},
      {"nanosleep", [] { static_cast<void>(nanosleep(&at_once, nullptr)); }},
      {"clock_nanosleep", [] { static_cast<void>(clock_nanosleep(CLOCK_MONOTONIC, 0, &at_once, nullptr)); }},
      {"syscall", [] { static_cast<void>(::syscall(SYS_futex, &word, FUTEX_WAIT, 1, nullptr, nullptr, 0)); }},
      {"read", [] { static_cast<void>(::read(-1, &byte, 1) + 0); }},
      {"write", [] { static_cast<void>(::write(-1, &byte, 1) + 0); }},
      {"poll", [] { static_cast<void>(::poll(nullptr, 0, 0)); }},
  };
}

TEST(RealtimePath, TheCounterSeesEachBlockingCallInsideTheScopeAndOnlyThere) {
  for (const BlockingCall& blocking : blocking_calls()) {
    forget_forbidden_calls();
    blocking.call();
    EXPECT_EQ(forbidden_calls().blocking, 0) << blocking.name;
    {
      const RealtimeScope realtime;
      blocking.call();
    }
    EXPECT_EQ(forbidden_calls().blocking, 1) << blocking.name;
    EXPECT_EQ(forbidden_calls().first_blocking, blocking.name);
  }
}

TEST(RealtimePath, ANamedWaitIsNoneOfTheScopeAroundIt) {
  forget_forbidden_calls();
  const RealtimeScope realtime;
  {
    const NamedWait wait;
    std::this_thread::sleep_for(std::chrono::microseconds(1));
  }
  EXPECT_EQ(forbidden_calls().blocking, 0);
  std::this_thread::sleep_for(std::chrono::microseconds(1));
  EXPECT_EQ(forbidden_calls().blocking, 1);
}

void deliver_all(ReplaySetup& s, LockstepRuntime& runtime) {
  for (;;) {
    auto event = s.reader.next();
    ASSERT_TRUE(event.has_value()) << event.error().message;
    if (!*event) break;
    runtime.deliver(**event);
  }
}

struct RealtimePathIn : testing::TestWithParam<Precision> {};

TEST_P(RealtimePathIn, NeitherAllocatesNorBlocksInLockstepFromFirstFrameToMappedSurface) {
  ReplaySetup s = setup();
  s.pipeline.estimator.precision = GetParam();
  s.pipeline.lockstep = true;
  s.pipeline.clock_period = std::chrono::milliseconds(2);
  Pipeline pipeline(s.pipeline);
  LastSurface publication;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, publication);
  forget_forbidden_calls();
  ASSERT_NO_FATAL_FAILURE(deliver_all(s, runtime));
  pipeline.ask_to_forget();
  pipeline.forget_if_asked();
  pipeline.entrance().push_ecg({});
  expect_none();
  EXPECT_GT(publication.surfaces, 100);
  EXPECT_GT(publication.clock_surfaces, 2000);
  EXPECT_GT(publication.features, 10U) << "the path must have been exercised up to mapped features";
}

INSTANTIATE_TEST_SUITE_P(EachPrecision, RealtimePathIn, testing::Values(Precision::kDouble, Precision::kSingle),
                         [](const auto& param) { return param.param == Precision::kDouble ? "Double" : "Single"; });

TEST(RealtimePath, NeitherAllocatesNorBlocksWhileTheSetUpIsJudged) {
  ReplaySetup s = setup(PERIMAP_TEST_LONGER_RECORDING);
  s.pipeline.lockstep = true;
  Pipeline pipeline(s.pipeline);
  LastSurface publication;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, publication);
  forget_forbidden_calls();
  ASSERT_NO_FATAL_FAILURE(deliver_all(s, runtime));
  expect_none();
  EXPECT_GT(pipeline.setup_watcher().status_belief().judged(), 0U);
}

// With the shortest of budgets, so that features are shed, and while a trace is kept.
TEST(RealtimePath, NeitherAllocatesNorBlocksLiveWithAllThreads) {
  ReplaySetup s = setup();
  s.pipeline.clock_period = std::chrono::milliseconds(2);
  s.pipeline.budget = std::chrono::microseconds(100);
  FrameTrace trace(1000, s.pipeline.workers);
  Pipeline pipeline(s.pipeline, &trace);
  LastSurface publication;
  RuntimeSettings settings;
  settings.lock_memory = false;
  LiveRuntime runtime(pipeline, settings, publication);
  forget_forbidden_calls();
  runtime.start();
  ReplayFeeder feeder(std::move(s.reader), SensorIntake{&pipeline.entrance()});
  feeder.start(runtime.threads());
  while (!feeder.ended()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  runtime.end_of_sources();
  while (!runtime.all_released()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  feeder.stop();
  runtime.stop();
  EXPECT_FALSE(feeder.error().has_value());
  expect_none();
  EXPECT_GT(trace.arrivals.entries().size(), 100U);
  EXPECT_GT(trace.mapper.entries().size(), 700U);
  for (const FixedLog<FrameSlice>& worker : trace.workers) EXPECT_GT(worker.entries().size(), 300U);
  EXPECT_GT(publication.surfaces, 100);
  EXPECT_GT(publication.clock_surfaces, 100);
  EXPECT_GT(publication.features + pipeline.counters().features_shed.get(), 0U)
      << "the path must have been exercised up to mapped features, or to ones that are shed";
}

}  // namespace
}  // namespace perimap
