// Surfaces by the clock, alone and beside those of the frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/release_plan.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/deadline.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/model_moment.hpp"
#include "daemon/runtime/replay_feeder.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/recording/replay_reader.hpp"
#include "tests/integration/pipeline/collected_surfaces.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::CollectedSurface;
using test::CollectedSurfaces;

constexpr Duration kPeriod = milliseconds(4);

ReplaySetup setup() {
  auto made = prepare_replay(PERIMAP_TEST_RECORDING, std::nullopt, ReadMode::kStrict);
  if (!made) throw std::runtime_error(made.error().error.message);
  // The law is known, so that no surface is degraded for its sake.
  made->pipeline.law_from_image = false;
  return std::move(*made);
}

struct Streams {
  bool frames = true;
  Duration clock_period{0};
  Duration lead{0};
  Duration latency = milliseconds(50);
};

struct Published {
  std::vector<CollectedSurface> frames;
  std::vector<CollectedSurface> clock;
};

// The recording in lockstep; after `frames_for` since its first event the camera gives no more.
Published lockstep(const Streams& streams, Duration frames_for = Duration::max()) {
  ReplaySetup s = setup();
  s.pipeline.lockstep = true;
  s.pipeline.frame_stream = streams.frames;
  s.pipeline.clock_period = streams.clock_period;
  s.pipeline.lead = streams.lead;
  s.pipeline.latency = streams.latency;
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  std::optional<Instant> first;
  for (;;) {
    auto event = s.reader.next();
    if (!event) throw std::runtime_error(event.error().message);
    if (!*event) break;
    if (!first) first = arrival_of(**event);
    if (std::holds_alternative<FrameEvent>(**event) && arrival_of(**event) - *first > frames_for) continue;
    runtime.deliver(**event);
  }
  runtime.finish();
  return {collected.of(ReleaseStream::kFrame), collected.of(ReleaseStream::kClock)};
}

double distance_mm(const perimap_SurfaceFeature& a, const perimap_SurfaceFeature& b) {
  return std::hypot(a.position_W_mm[0] - b.position_W_mm[0], a.position_W_mm[1] - b.position_W_mm[1],
                    a.position_W_mm[2] - b.position_W_mm[2]);
}

double trace_mm2(const perimap_SurfaceFeature& f) {
  return f.covariance_W_mm2[0] + f.covariance_W_mm2[3] + f.covariance_W_mm2[5];
}

double speed_mm_per_s(const perimap_SurfaceFeature& f) {
  return std::hypot(f.velocity_W_mm_per_s[0], f.velocity_W_mm_per_s[1], f.velocity_W_mm_per_s[2]);
}

// But for that in the few seconds of the recording no feature converges.
bool nothing_is_wrong(const perimap_Surface& s) {
  return s.state == perimap_SURFACE_GOOD || s.reason == perimap_SURFACE_REASON_NOTHING_CONVERGED;
}

TEST(ReleaseStreams, TheClockReleasesOnItsGridWithoutAGap) {
  const Duration lead = milliseconds(30);
  const std::vector<CollectedSurface> clock = lockstep({false, kPeriod, lead}).clock;
  ASSERT_GT(clock.size(), 1000U);
  int good = 0;
  for (std::size_t i = 0; i < clock.size(); ++i) {
    const perimap_Surface& s = clock[i].head;
    EXPECT_EQ(s.release_time_ns % kPeriod.count(), 0);
    EXPECT_EQ(s.valid_time_ns, s.release_time_ns + lead.count());
    EXPECT_EQ(s.sample_sequence, i + 1);
    EXPECT_LT(s.capture_time_ns, s.release_time_ns);
    if (i > 0) {
      EXPECT_EQ(s.release_time_ns - clock[i - 1].head.release_time_ns, kPeriod.count());
      EXPECT_GE(s.frame_sequence, clock[i - 1].head.frame_sequence);
    }
    good += nothing_is_wrong(s) ? 1 : 0;
  }
  EXPECT_GT(good, 100);
}

TEST(ReleaseStreams, TheClockBesideThemChangesNothingOfTheFramesSurfaces) {
  const std::vector<CollectedSurface> alone = lockstep({}).frames;
  const Published both = lockstep({true, kPeriod, Duration(0)});
  const std::vector<CollectedSurface>& beside = both.frames;
  EXPECT_GT(both.clock.size(), 1000U);
  ASSERT_EQ(alone.size(), beside.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(alone[i].head.sample_sequence, beside[i].head.sample_sequence);
    EXPECT_EQ(alone[i].head.release_time_ns, beside[i].head.release_time_ns);
    EXPECT_EQ(alone[i].head.reason, beside[i].head.reason);
    ASSERT_EQ(alone[i].features.size(), beside[i].features.size());
    for (std::size_t k = 0; k < alone[i].features.size(); ++k) {
      const perimap_SurfaceFeature& a = alone[i].features[k];
      const perimap_SurfaceFeature& b = beside[i].features[k];
      EXPECT_EQ(a.id, b.id);
      for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(a.position_W_mm[axis], b.position_W_mm[axis]);
      for (int element = 0; element < 6; ++element) EXPECT_EQ(a.covariance_W_mm2[element], b.covariance_W_mm2[element]);
    }
  }
}

// The clock's surface of nearly the same instant: the same motion, and hardly another covariance, though that is
// interpolated.
void expect_the_same_surface(Duration latency) {
  const Published both = lockstep({true, kPeriod, Duration(0), latency});
  const std::vector<CollectedSurface>& clock = both.clock;
  int compared = 0;
  int alike = 0;
  for (const CollectedSurface& frame : both.frames) {
    if (!nothing_is_wrong(frame.head) || clock.empty()) continue;
    const auto i = (frame.head.release_time_ns - clock.front().head.release_time_ns) / kPeriod.count();
    if (i < 0 || i >= static_cast<std::int64_t>(clock.size())) continue;
    const CollectedSurface& tick = clock[static_cast<std::size_t>(i)];
    if (!nothing_is_wrong(tick.head)) continue;
    const double dt_s = static_cast<double>(frame.head.valid_time_ns - tick.head.valid_time_ns) * 1e-9;
    std::map<std::uint32_t, perimap_SurfaceFeature> of_frame;
    for (const perimap_SurfaceFeature& f : frame.features) of_frame[f.id] = f;
    for (const perimap_SurfaceFeature& f : tick.features) {
      const auto other = of_frame.find(f.id);
      if (other == of_frame.end()) continue;
      ++compared;
      const double ratio = trace_mm2(f) / trace_mm2(other->second);
      const bool near = distance_mm(f, other->second) < 1.5 * std::abs(dt_s) * speed_mm_per_s(f) + 0.5;
      alike += near && ratio > 0.5 && ratio < 2.0 ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 100);
  EXPECT_GT(alike, 0.9 * compared);
}

TEST(ReleaseStreams, BothStreamsTellTheSameSurface) { expect_the_same_surface(milliseconds(50)); }

// When a frame is released the next five have been mapped.
TEST(ReleaseStreams, BothStreamsTellTheSameSurfaceWhenTheLatencyIsManyFrames) {
  expect_the_same_surface(milliseconds(200));
}

TEST(ReleaseStreams, WhereTheCameraWasIsToldWhateverTheLatency) {
  const auto known = [](Duration latency) {
    int count = 0;
    for (const CollectedSurface& s : lockstep({true, Duration(0), Duration(0), latency}).frames) {
      count += s.head.camera_pose_known ? 1 : 0;
    }
    return count;
  };
  const int usual = known(milliseconds(50));
  EXPECT_GT(usual, 100);
  EXPECT_GE(known(milliseconds(200)), usual);
}

TEST(ReleaseStreams, WhenFramesStopTheClockSaysSoAndItsSurfacesKeepTheirAge) {
  const std::vector<CollectedSurface> clock = lockstep({true, kPeriod, Duration(0)}, milliseconds(5750)).clock;
  ASSERT_FALSE(clock.empty());
  const std::int64_t last_capture_ns = clock.back().head.capture_time_ns;
  // The first frame that has not come is owed a period (33 ms) and L after the last, with some jitter.
  const std::int64_t owed_ns = last_capture_ns + 34'000'000 + 50'000'000 + 4'000'000;
  int before = 0;
  int after = 0;
  for (const CollectedSurface& s : clock) {
    if (s.head.release_time_ns < last_capture_ns) before += nothing_is_wrong(s.head) ? 1 : 0;
    if (s.head.release_time_ns < owed_ns) continue;
    ++after;
    EXPECT_FALSE(nothing_is_wrong(s.head));
    EXPECT_EQ(s.head.capture_time_ns, last_capture_ns) << "no frame is made up";
    for (const perimap_SurfaceFeature& f : s.features) EXPECT_LE(f.last_observed_time_ns, last_capture_ns);
  }
  EXPECT_GT(before, 10);
  EXPECT_GT(after, 20);
}

// A frame, a pose or a block of ECG comes in, and nobody maps what came.
void let_in(const ReplayEvent& event, Pipeline& pipeline) {
  SensorEntrance& entrance = pipeline.entrance();
  if (const auto* frame = std::get_if<FrameEvent>(&event)) {
    static_cast<void>(entrance.push_frame(frame->stamp, frame->image()));
    pipeline.drain_stamps(frame->stamp.arrival);
  } else if (const auto* pose = std::get_if<TrackerSample>(&event)) {
    entrance.push_pose(*pose);
  } else if (const auto* ecg = std::get_if<EcgBlock>(&event)) {
    entrance.push_ecg(*ecg);
  }
}

SurfaceReason model_reason(Pipeline& pipeline, Instant now) {
  const CardiacClock clock = pipeline.status_clock(now);
  const ModelMoment moment = model_moment(pipeline, clock, pipeline.status_respiration(), now);
  return reason_of(clock.at(now), clock.rhythm(), moment.footing);
}

TEST(ReleaseStreams, WhileTheMapperHangsTheModelSaysSoAsTheSurfacesDo) {
  ReplaySetup s = setup();
  s.pipeline.lockstep = true;
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  LockstepRuntime runtime(pipeline, s.identity, s.utc_minus_monotonic, collected);
  std::optional<Instant> first;
  bool hangs = false;
  int good_before = 0;
  int late = 0;
  for (auto event = s.reader.next(); event && *event; event = s.reader.next()) {
    const Instant now = arrival_of(**event);
    if (!first) first = now;
    if (now - *first <= milliseconds(5500)) {
      runtime.deliver(**event);
      const SurfaceReason reason = model_reason(pipeline, now);
      good_before += reason == SurfaceReason::kNone || reason == SurfaceReason::kNothingConverged ? 1 : 0;
      continue;
    }
    hangs = true;
    for (auto next = pipeline.plan().next(); next && next->deadline <= now; next = pipeline.plan().next()) {
      const Instant deadline = next->deadline;
      const SurfaceReason surface = pipeline.compose(pipeline.plan().take_release()).reason;
      if (surface != SurfaceReason::kUpdateLate) continue;
      EXPECT_EQ(model_reason(pipeline, deadline), SurfaceReason::kUpdateLate);
      ++late;
    }
    let_in(**event, pipeline);
  }
  EXPECT_TRUE(hangs);
  EXPECT_GT(good_before, 5) << "while frames are mapped nothing is wrong";
  EXPECT_GT(late, 5);
}

// The recording in real time with all threads, to its last release.
void play_live(ReplayReader reader, Pipeline& pipeline, Publication& publication) {
  RuntimeSettings settings;
  settings.lock_memory = false;
  LiveRuntime runtime(pipeline, settings, publication);
  runtime.start();
  ReplayFeeder feeder(std::move(reader), SensorIntake{&pipeline.entrance()});
  feeder.start(runtime.threads());
  while (!feeder.ended()) std::this_thread::sleep_for(milliseconds(50));
  runtime.end_of_sources();
  while (!runtime.all_released()) std::this_thread::sleep_for(milliseconds(10));
  feeder.stop();
  runtime.stop();
}

TEST(ReleaseStreams, LiveEveryReleaseOfTheGridIsPublishedOrCountedAsMissed) {
  ReplaySetup s = setup();
  s.pipeline.frame_stream = false;
  s.pipeline.clock_period = milliseconds(2);
  Pipeline pipeline(s.pipeline);
  CollectedSurfaces collected;
  play_live(std::move(s.reader), pipeline, collected);
  EXPECT_TRUE(collected.of(ReleaseStream::kFrame).empty());
  const std::vector<CollectedSurface> clock = collected.of(ReleaseStream::kClock);
  ASSERT_GT(clock.size(), 10U);
  const StreamCounters& counters = pipeline.counters().of(ReleaseStream::kClock);
  const auto grid = (clock.back().head.release_time_ns - clock.front().head.release_time_ns) / 2'000'000 + 1;
  // What was left out after the last one is counted too.
  EXPECT_GE(clock.size() + counters.releases_missed.get(), static_cast<std::size_t>(grid));
  EXPECT_EQ(counters.samples.get(), clock.size());
  EXPECT_EQ(clock.back().head.sample_sequence, clock.size());
  EXPECT_EQ(pipeline.counters().frames_too_late.get() + pipeline.counters().frames_dropped.get() +
                    pipeline.counters().frames.get() >=
                pipeline.counters().frames_received.get(),
            true)
      << "frames are mapped as with their own releases";
}

// Publication that is held up once, as a process that was stopped.
class HeldUpOnce final : public Publication {
 public:
  explicit HeldUpOnce(Duration by) : by_(by) {}
  void surface(const perimap_Surface& sample) override {
    late_ += MonotonicClock::now() - from_ns(sample.release_time_ns) > kOnTime ? 1U : 0U;
    if (++count_ == 30) {
      std::this_thread::sleep_for(by_);
      went_on_ = MonotonicClock::now();
    }
    collected_.surface(sample);
  }
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}
  [[nodiscard]] std::vector<CollectedSurface> frames() const { return collected_.of(ReleaseStream::kFrame); }
  [[nodiscard]] Instant went_on() const { return went_on_; }
  // How many surfaces were not on time when they came here, which is after the pipeline has looked at its clock.
  [[nodiscard]] std::uint64_t late() const { return late_; }

 private:
  Duration by_;
  int count_ = 0;
  Instant went_on_;
  std::uint64_t late_ = 0;
  CollectedSurfaces collected_;
};

TEST(ReleaseStreams, LiveAPublisherThatWasHeldUpLeavesOutWhatIsStaleAndCountsIt) {
  constexpr Duration kHeldUp = milliseconds(1500);
  ReplaySetup s = setup();
  const Duration usable = s.pipeline.lead + s.pipeline.validity;
  Pipeline pipeline(s.pipeline);
  HeldUpOnce publication(kHeldUp);
  play_live(std::move(s.reader), pipeline, publication);
  const std::vector<CollectedSurface> frames = publication.frames();
  const StreamCounters& counters = pipeline.counters().of(ReleaseStream::kFrame);
  ASSERT_GT(frames.size(), 31U);
  const std::int64_t gap = frames[30].head.release_time_ns - frames[29].head.release_time_ns;
  EXPECT_GE(gap, (kHeldUp - usable).count()) << "nothing is sent of which the validity has passed";
  EXPECT_GT(counters.releases_missed.get(), 30U) << "at 30 frames/s";
  EXPECT_EQ(counters.samples.get(), frames.size());
  // Those that had been due while it was held up, and were sent after it.
  const auto made_up_for = std::count_if(frames.begin() + 30, frames.end(), [&](const CollectedSurface& surface) {
    return publication.went_on() - from_ns(surface.head.release_time_ns) > kOnTime;
  });
  EXPECT_GE(counters.releases_late.get(), static_cast<std::uint64_t>(made_up_for));
  EXPECT_LE(counters.releases_late.get(), publication.late()) << "what was left out does not count as late as well";
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].head.sample_sequence, i + 1);
}

}  // namespace
}  // namespace perimap
