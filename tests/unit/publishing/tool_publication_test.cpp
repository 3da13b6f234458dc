#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>

#include "core/tool/tool_distance.hpp"
#include "daemon/dds/sample_readers.hpp"
#include "daemon/publishing/dds_publication.hpp"
#include "daemon/publishing/tool_text.hpp"
#include "daemon/publishing/wire_tool.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

constexpr int kDomain = 121;

ToolDistance told() {
  ToolDistance told;
  told.tip_known = told.touches = true;
  told.tip.p_WT_mm = {1.0, 2.0, 3.0};
  told.last_seen = Instant{std::chrono::seconds(4)};
  for (DistanceAhead& ahead : told.ahead) {
    ahead.state = SurfaceState::kGood;
    ahead.distance_mm = 0.25;
    ahead.deviation_mm = 0.5;
    ahead.rate_mm_per_s = -7.0;
  }
  told.ahead[2].state = SurfaceState::kInvalid;
  told.ahead[2].reason = ToolDistanceReason::kBeyondEdge;
  told.ahead[2].distance_mm = std::numeric_limits<double>::quiet_NaN();
  return told;
}

SurfaceRelease release() {
  SurfaceRelease release;
  release.sample_sequence = 42;
  release.release_time = Instant{std::chrono::seconds(5)};
  release.valid_time = Instant{std::chrono::milliseconds(5010)};
  release.valid_until = Instant{std::chrono::milliseconds(5200)};
  release.state = SurfaceState::kGood;
  return release;
}

TEST(WireTool, SaysWhatWasTold) {
  WireTool wire({"theatre 3", ReleaseStream::kFrame, "tracker"}, "instrument/probe");
  const perimap_ToolDistance& sample = wire.fill(told(), release(), std::chrono::seconds(100));
  EXPECT_STREQ(sample.source, "theatre 3");
  EXPECT_STREQ(sample.tool, "instrument/probe");
  EXPECT_EQ(sample.sample_sequence, 1U);
  EXPECT_EQ(sample.surface_sequence, 42U);
  EXPECT_EQ(sample.time_ns, 5'010'000'000);
  EXPECT_EQ(sample.release_utc_ns, 105'000'000'000);
  EXPECT_EQ(sample.state, perimap_TOOL_GOOD);
  EXPECT_EQ(sample.reasons[2], perimap_TOOL_REASON_BEYOND_EDGE);
  EXPECT_TRUE(sample.touches);
  EXPECT_EQ(sample.tip_W_mm[2], 3.0);
  EXPECT_EQ(sample.last_seen_time_ns, 4'000'000'000);
  EXPECT_THAT(tool_words(sample), HasSubstr("instrument/probe TOUCHES, 0.2 +- 0.5 mm, -7 mm/s"));
  EXPECT_EQ(wire.fill(told(), release(), Duration(0)).sample_sequence, 2U);
}

TEST(WireTool, ATipThatIsNotKnownIsNoNumber) {
  WireTool wire({"a", ReleaseStream::kFrame, "tracker"}, "pointer");
  ToolDistance nothing;
  for (DistanceAhead& ahead : nothing.ahead) ahead.reason = ToolDistanceReason::kNotSeen;
  const perimap_ToolDistance& sample = wire.fill(nothing, release(), Duration(0));
  EXPECT_EQ(sample.state, perimap_TOOL_INVALID);
  EXPECT_EQ(sample.reason, perimap_TOOL_REASON_NOT_SEEN);
  EXPECT_TRUE(std::isnan(sample.tip_W_mm[0]));
  EXPECT_TRUE(std::isnan(sample.tip_covariance_W_mm2[5]));
  EXPECT_EQ(tool_reason_name(sample.reason), "not_seen");
}

class ToolPublication : public ::testing::Test {
 protected:
  ToolPublication() {
    const std::string uri =
        "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
        "<AllowMulticast>false</AllowMulticast></General><Discovery><Tag>perimap-unit-" +
        std::to_string(::getpid()) + "</Tag></Discovery></Domain></CycloneDDS>";
    setenv("CYCLONEDDS_URI", uri.c_str(), 1);
  }
};

TEST_F(ToolPublication, IsHeardByWhoAsksForTools) {
  auto readers = SampleReaders::create(kDomain, false, true);
  ASSERT_TRUE(readers && readers->tools);
  DdsSettings settings;
  settings.membership = kDomain;
  settings.tools = true;
  const auto publication = DdsPublication::create(settings);
  ASSERT_TRUE(publication);
  WireTool wire({"theatre 3", ReleaseStream::kFrame, "tracker"}, "pointer");
  const Instant deadline = MonotonicClock::now() + std::chrono::seconds(20);
  bool heard = false;
  while (!heard && MonotonicClock::now() < deadline) {
    (*publication)->tool(wire.fill(told(), release(), Duration(0)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const auto loan = readers->tools->take();
    ASSERT_TRUE(loan);
    for (std::size_t i = 0; i < loan->size(); ++i) {
      const perimap_ToolDistance* sample = loan->sample(i);
      if (sample == nullptr) continue;
      heard = true;
      EXPECT_STREQ(sample->tool, "pointer");
      EXPECT_EQ(sample->distances_mm[0], 0.25);
      EXPECT_TRUE(std::isnan(sample->distances_mm[2]));
    }
  }
  EXPECT_TRUE(heard);
  EXPECT_EQ((*publication)->failures(), 0U);
}

TEST_F(ToolPublication, WithoutToolsThereIsNoWriter) {
  DdsSettings settings;
  settings.membership = kDomain;
  const auto publication = DdsPublication::create(settings);
  ASSERT_TRUE(publication);
  WireTool wire({"a", ReleaseStream::kFrame, "tracker"}, "pointer");
  (*publication)->tool(wire.fill(told(), release(), Duration(0)));
  EXPECT_EQ((*publication)->failures(), 0U);
  dds_entity_t participant = 0;
  ASSERT_EQ(dds_lookup_participant(kDomain, &participant, 1), 1);
  EXPECT_LE(dds_find_topic(DDS_FIND_SCOPE_PARTICIPANT, participant, "perimap/tool", nullptr, 0), 0);
}

}  // namespace
}  // namespace perimap
