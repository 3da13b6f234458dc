// A recording that was cut together, or garbled: a year between two frames.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kYear = std::chrono::days(365);
constexpr Duration kPeriod = milliseconds(33);

class Times final : public Publication {
 public:
  void surface(const perimap_Surface& sample) override { released.push_back(from_ns(sample.release_time_ns)); }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  std::vector<Instant> released;
};

PipelineSettings settings(Duration clock_period) {
  PipelineSettings s;
  s.lockstep = true;
  s.workers = 1;
  s.camera.width = 64;
  s.camera.height = 48;
  s.camera.fx = s.camera.fy = 50.0;
  s.features.maximum = 8;
  s.latency = milliseconds(50);
  s.clock_period = clock_period;
  return s;
}

FrameEvent frame(std::uint64_t sequence, Instant capture) {
  FrameEvent event;
  event.stamp = {sequence, capture, capture + milliseconds(12)};
  event.width = 64;
  event.height = 48;
  event.pixels.assign(64 * 48, 100);
  return event;
}

// Two seconds of frames, `gap` after which nothing comes, two more.
std::vector<Instant> play(Duration gap, Duration clock_period, std::uint64_t& gaps, std::uint64_t& passed_over) {
  Times times;
  Pipeline pipeline(settings(clock_period));
  LockstepRuntime runtime(pipeline, Identity{"gap", ReleaseStream::kFrame, "tracker"}, Duration(0), times);
  Instant t(seconds(10));
  for (std::uint64_t i = 0; i < 120; ++i, t += kPeriod) {
    if (i == 60) t += gap;
    runtime.deliver(frame(i, t));
  }
  runtime.finish();
  gaps = runtime.gaps();
  passed_over = runtime.releases_passed_over();
  return times.released;
}

TEST(RecordingGap, AYearIsPassedOverButForItsFirstMinuteAndSurfacesGoOnAfterIt) {
  for (const Duration clock_period : {Duration(0), Duration(milliseconds(10))}) {
    std::uint64_t gaps = 0;
    std::uint64_t passed_over = 0;
    const std::vector<Instant> released = play(kYear, clock_period, gaps, passed_over);
    EXPECT_EQ(gaps, 1U);
    const auto per_year = static_cast<std::uint64_t>(kYear / kPeriod) +
                          (clock_period > Duration(0) ? static_cast<std::uint64_t>(kYear / clock_period) : 0U);
    EXPECT_NEAR(static_cast<double>(passed_over), static_cast<double>(per_year), 1e-3 * static_cast<double>(per_year));
    const Instant silent(seconds(10) + 60 * kPeriod);
    std::size_t within = 0;
    std::size_t after = 0;
    for (const Instant& t : released) {
      within += t > silent + seconds(1) && t < silent + kYear ? 1U : 0U;
      after += t >= silent + kYear ? 1U : 0U;
    }
    EXPECT_GT(within, 1'500U) << "a camera that is gone is said to be, for a minute";
    EXPECT_LT(within, 9'000U);
    EXPECT_GE(after, 58U);
    for (std::size_t i = 1; i < released.size(); ++i) EXPECT_LE(released[i - 1], released[i]) << i;
  }
}

TEST(RecordingGap, HalfAMinuteIsPlayed) {
  std::uint64_t gaps = 0;
  std::uint64_t passed_over = 0;
  const std::vector<Instant> released = play(seconds(30), Duration(0), gaps, passed_over);
  EXPECT_EQ(gaps, 0U);
  EXPECT_EQ(passed_over, 0U);
  EXPECT_GT(released.size(), 120U + 850U);
}

}  // namespace
}  // namespace perimap
