// The status topic follows the sources' states, however long its interval.
#include <gtest/gtest.h>

#include <array>
#include <atomic>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "wait_until.hpp"

namespace perimap {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

// The tracker's state as it was last told.
class ToldState final : public Publication {
 public:
  void surface(const perimap_Surface& /*sample*/) override {}
  void surface_model(const perimap_SurfaceModel& /*model*/) override {}
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& status) override {
    for (std::uint32_t i = 0; i < status.sources._length; ++i) {
      const perimap_SourceStatus& source = status.sources._buffer[i];
      if (source.kind == perimap_SOURCE_TRACKER) tracker_ = source.state;
    }
    ++statuses_;
  }

  [[nodiscard]] perimap_SourceState tracker() const { return tracker_; }
  [[nodiscard]] int statuses() const { return statuses_; }

 private:
  std::atomic<perimap_SourceState> tracker_{perimap_SOURCE_ENDED};
  std::atomic<int> statuses_{0};
};

TEST(SourceState, IsPublishedWhenItChangesAndNotOnlyEveryInterval) {
  PipelineSettings pipeline_settings;
  pipeline_settings.camera.width = 64;
  pipeline_settings.camera.height = 48;
  pipeline_settings.camera.fx = pipeline_settings.camera.fy = 50.0;
  Pipeline pipeline(pipeline_settings);
  ToldState told;
  RuntimeSettings settings;
  settings.lock_memory = false;
  settings.phase_interval = milliseconds(5);
  settings.status_interval = hours(1);
  settings.stalled_after = milliseconds(50);
  LiveRuntime runtime(pipeline, settings, told);
  std::atomic<bool> closed{true};
  runtime.describe_sources_by([&closed](StatusFacts& facts) { facts.tracker.closed = closed.load(); });
  const auto becomes = [&told](perimap_SourceState state) {
    return wait_until([&told, state] { return told.tracker() == state; });
  };
  const auto comes = [&] {
    return wait_until([&] {
      TrackerSample sample;
      sample.source_time = sample.arrival = MonotonicClock::now();
      pipeline.entrance().push_pose(sample);
      return told.tracker() == perimap_SOURCE_OK;
    });
  };
  runtime.start();
  EXPECT_TRUE(becomes(perimap_SOURCE_CLOSED));
  closed = false;
  EXPECT_TRUE(becomes(perimap_SOURCE_STARTING));
  EXPECT_TRUE(comes());
  EXPECT_TRUE(becomes(perimap_SOURCE_STALLED)) << "silent, and still open";
  EXPECT_TRUE(comes());
  closed = true;
  EXPECT_TRUE(becomes(perimap_SOURCE_CLOSED));
  // Where nothing changes nothing is told.
  const int statuses = told.statuses();
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(told.statuses(), statuses);
  runtime.stop();
}

}  // namespace
}  // namespace perimap
