// The real-time path makes no heap call: the allocator is interposed for the whole process, and every call inside a
// RealtimeScope is counted. Not built with sanitizers, which bring their own allocator.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"

namespace {

std::atomic<int> heap_calls_in_scope{0};

void count() noexcept {
  if (perimap::RealtimeScope::depth() > 0) heap_calls_in_scope.fetch_add(1);
}

}  // namespace

// glibc's own allocator under its other names (malloc.h, "Replacing malloc", glibc manual).
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t n) {
  count();
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t n) {
  count();
  return __libc_realloc(p, n);
}
void* memalign(std::size_t alignment, std::size_t n) {
  count();
  return __libc_memalign(alignment, n);
}
void* aligned_alloc(std::size_t alignment, std::size_t n) {
  count();
  return __libc_memalign(alignment, n);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t n) {
  count();
  *out = __libc_memalign(alignment, n);
  return *out == nullptr ? ENOMEM : 0;
}
void free(void* p) {
  if (p != nullptr) count();
  __libc_free(p);
}
}

namespace perimap {
namespace {

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

ReplaySetup setup() {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  return std::move(*made);
}

TEST(RealtimePath, TheCounterSeesAHeapCallInsideTheScopeAndOnlyThere) {
  heap_calls_in_scope = 0;
  std::unique_ptr<std::vector<int>> outside = std::make_unique<std::vector<int>>(1000);
  EXPECT_EQ(heap_calls_in_scope, 0);
  {
    const RealtimeScope realtime;
    outside->resize(100'000);
  }
  EXPECT_GT(heap_calls_in_scope, 0);
}

struct RealtimePathIn : testing::TestWithParam<Precision> {};

TEST_P(RealtimePathIn, MakesNoHeapCallInLockstepFromFirstFrameToMappedSurface) {
  ReplaySetup s = setup();
  s.pipeline.estimator.precision = GetParam();
  s.pipeline.lockstep = true;
  s.pipeline.clock_period = std::chrono::milliseconds(2);
  Pipeline pipeline(s.pipeline);
  LastSurface publication;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, publication);
  heap_calls_in_scope = 0;
  for (;;) {
    auto event = s.reader.next();
    ASSERT_TRUE(event.has_value()) << event.error().message;
    if (!*event) break;
    runtime.deliver(**event);
  }
  pipeline.ask_to_forget();
  pipeline.forget_if_asked();
  pipeline.entrance().push_ecg({});
  EXPECT_EQ(heap_calls_in_scope, 0);
  EXPECT_GT(publication.surfaces, 100);
  EXPECT_GT(publication.clock_surfaces, 2000);
  EXPECT_GT(publication.features, 10U) << "the path must have been exercised up to mapped features";
}

INSTANTIATE_TEST_SUITE_P(EachPrecision, RealtimePathIn, testing::Values(Precision::kDouble, Precision::kSingle),
                         [](const auto& param) { return param.param == Precision::kDouble ? "Double" : "Single"; });

// With the shortest of budgets, so that features are shed.
TEST(RealtimePath, MakesNoHeapCallLiveWithAllThreads) {
  ReplaySetup s = setup();
  s.pipeline.clock_period = std::chrono::milliseconds(2);
  s.pipeline.budget = std::chrono::microseconds(100);
  Pipeline pipeline(s.pipeline);
  LastSurface publication;
  RuntimeSettings settings;
  settings.lock_memory = false;
  LiveRuntime runtime(pipeline, settings, publication);
  heap_calls_in_scope = 0;
  runtime.start();
  ReplayFeeder feeder(std::move(s.reader), SensorIntake{&pipeline.entrance()});
  feeder.start(runtime.threads());
  while (!feeder.ended()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  runtime.end_of_sources();
  while (!runtime.all_released()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  feeder.stop();
  runtime.stop();
  EXPECT_FALSE(feeder.error().has_value());
  EXPECT_EQ(heap_calls_in_scope, 0);
  EXPECT_GT(publication.surfaces, 100);
  EXPECT_GT(publication.clock_surfaces, 100);
  EXPECT_GT(publication.features + pipeline.counters().features_shed.get(), 0U)
      << "the path must have been exercised up to mapped features, or to ones that are shed";
}

}  // namespace
}  // namespace perimap
