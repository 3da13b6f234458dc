#include "daemon/bridge/foxglove/surface_messages.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/bridge/foxglove_protocol/foxglove_protocol.hpp"
#include "daemon/bridge/messages/view_topics.hpp"

namespace perimap {
namespace {

TEST(SurfaceChannels, CarryTheTextOfTheirTypes) {
  const auto json = nlohmann::json::parse(foxglove_advertise(surface_channels()));
  EXPECT_EQ(json["op"], "advertise");
  ASSERT_EQ(json["channels"].size(), kSurfaceChannels);
  for (std::size_t i = 0; i < kSurfaceChannels; ++i) {
    const auto& channel = json["channels"][i];
    EXPECT_EQ(channel["id"], i);
    EXPECT_EQ(channel["encoding"], "cdr");
    EXPECT_EQ(channel["schemaEncoding"], "omgidl");
    const std::string name = channel["schemaName"];
    const std::string text = channel["schema"];
    EXPECT_NE(text.find("struct " + name.substr(name.rfind(':') + 1)), std::string::npos) << name;
  }
}

class SurfaceMessagesTest : public testing::Test {
 protected:
  static ShownSurface good() {
    ShownSurface shown;
    shown.state = perimap_SURFACE_GOOD;
    shown.frame_id = "world";
    shown.phase_rad = 1.25;
    shown.valid = from_ns(5'000'000'000);
    shown.valid_until = shown.valid + std::chrono::milliseconds(200);
    shown.capture = shown.valid - std::chrono::milliseconds(50);
    shown.utc_minus_monotonic = std::chrono::seconds(1'795'000'000);
    shown.X_WC = Pose{so3_exp(Vector3d(0.3, -0.4, 0.5)), Vector3d(10, -20, 30)};
    shown.features = {{3, perimap_FEATURE_CONVERGED, {1, 2, 3}, 0.25}};
    return shown;
  }
  template <class T>
  static Sample<T> read(const SurfaceMessages& messages, SurfaceChannel channel) {
    const std::string& cdr = messages[static_cast<std::size_t>(channel)].cdr;
    auto sample = deserialize<T>(std::as_bytes(std::span(cdr)));
    EXPECT_TRUE(sample) << sample.error().message;
    return std::move(*sample);
  }
  SurfaceMessageMaker maker_;
};

TEST_F(SurfaceMessagesTest, StandAtTheInstantThatTheySpeakOf) {
  const auto messages = maker_.of(good(), from_ns(1));
  ASSERT_TRUE(messages) << messages.error().message;
  const auto utc_ns = [&](SurfaceChannel channel) { return to_ns((*messages)[static_cast<std::size_t>(channel)].utc); };
  EXPECT_EQ(utc_ns(SurfaceChannel::kScene), 1'795'000'005'000'000'000);
  EXPECT_EQ(utc_ns(SurfaceChannel::kWorth), 1'795'000'005'000'000'000);
  EXPECT_EQ(utc_ns(SurfaceChannel::kTransforms), 1'795'000'004'950'000'000);
  const auto scene = read<foxglove_SceneUpdate>(*messages, SurfaceChannel::kScene);
  ASSERT_EQ(scene->entities._length, 2U);
  const foxglove_SceneEntity& features = scene->entities._buffer[1];
  EXPECT_STREQ(features.frame_id, "world");
  ASSERT_EQ(features.spheres._length, 1U);
  EXPECT_NEAR(features.spheres._buffer[0].pose.position.z, 0.003, 1e-12);
  const auto worth = read<perimap_view_SurfaceWorth>(*messages, SurfaceChannel::kWorth);
  EXPECT_STREQ(worth->state, "good");
  EXPECT_EQ(worth->converged, 1U);
  EXPECT_EQ(worth->phase_rad, 1.25);
  const auto transform = read<foxglove_FrameTransform>(*messages, SurfaceChannel::kTransforms);
  EXPECT_STREQ(transform->parent_frame_id, "world");
  EXPECT_NEAR(transform->translation.y, -0.02, 1e-12);
}

TEST_F(SurfaceMessagesTest, AToolIsASphereWithItsWordsAndAWayToTheSurface) {
  ShownSurface shown = good();
  ShownTool tool;
  tool.name = "pointer";
  tool.at.refusal = client::ToolRefusal::kNone;
  tool.at.state = perimap_TOOL_GOOD;
  tool.at.distance_mm = 3.25;
  tool.at.deviation_mm = 0.5;
  tool.at.rate_mm_per_s = 0.0;
  tool.at.tip_known = true;
  tool.at.tip_W_mm = {1, 2, 3};
  tool.nearest_W_mm = {1, 2, 6};
  shown.tools = {tool, tool};
  shown.tools[1].at.tip_known = false;  // nobody knows where this one is
  const auto messages = maker_.of(shown, from_ns(1));
  ASSERT_TRUE(messages) << messages.error().message;
  const auto scene = read<foxglove_SceneUpdate>(*messages, SurfaceChannel::kScene);
  ASSERT_EQ(scene->entities._length, 3U);
  const foxglove_SceneEntity& tools = scene->entities._buffer[2];
  EXPECT_STREQ(tools.id, "tools");
  ASSERT_EQ(tools.spheres._length, 1U);
  EXPECT_NEAR(tools.spheres._buffer[0].pose.position.z, 0.003, 1e-12);
  ASSERT_EQ(tools.texts._length, 1U);
  EXPECT_STREQ(tools.texts._buffer[0].text, "pointer 3.2 +- 0.5 mm, +0 mm/s");
  ASSERT_EQ(tools.lines._length, 1U);
  ASSERT_EQ(tools.lines._buffer[0].points._length, 2U);
  EXPECT_NEAR(tools.lines._buffer[0].points._buffer[1].z, 0.006, 1e-12);
}

TEST_F(SurfaceMessagesTest, OfNothingTakeAwayWhatWasShown) {
  ASSERT_TRUE(maker_.of(good(), from_ns(1)));
  ShownSurface nothing;
  nothing.frame_id = "world";
  const auto messages = maker_.of(nothing, from_ns(1'795'000'000'000'000'000));
  ASSERT_TRUE(messages) << messages.error().message;
  const auto scene = read<foxglove_SceneUpdate>(*messages, SurfaceChannel::kScene);
  EXPECT_EQ(scene->entities._length, 0U);
  EXPECT_GT(scene->deletions._length, 0U);
  EXPECT_EQ((*messages)[0].utc, from_ns(1'795'000'000'000'000'000));
  EXPECT_STREQ(read<perimap_view_SurfaceWorth>(*messages, SurfaceChannel::kWorth)->state, "invalid");
  EXPECT_TRUE((*messages)[static_cast<std::size_t>(SurfaceChannel::kTransforms)].cdr.empty());
}

}  // namespace
}  // namespace perimap
