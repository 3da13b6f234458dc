// `perimap bridge foxglove` between a scripted perimapd and a viewer's connection: what is received is what was
// published, value by value, and an invalid surface clears it. integration_bridge_foxglove does the same with the
// protocol's official client, where npm is there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "bridge_test.hpp"
#include "daemon/bridge/messages/view_topics.hpp"
#include "drivers/recording/cdr.hpp"
#include "viewer_client.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using test::MadePublication;
using test::ViewerClient;
using testing::AnyOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr std::uint32_t kFirstSubscription = 70;

Instant instant_of(const foxglove_Time& t) {
  return from_ns(std::int64_t{1'000'000'000} * t.sec + std::int64_t{t.nsec});
}

class BridgeFoxglove : public test::BridgeTest {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(BridgeTest::SetUp());
    program_->start({"bridge", "foxglove", "--domain", std::to_string(domain_), "--port", "0"});
    const std::string address = program_->first_line();
    ASSERT_THAT(address, StartsWith("ws://127.0.0.1:")) << program_->said();
    port_ = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  }
  void TearDown() override {
    viewer_.reset();
    BridgeTest::TearDown();
  }

  // Connects, and subscribes to all that is offered.
  void open_viewer() {
    viewer_ = std::make_unique<ViewerClient>(port_);
    ASSERT_TRUE(viewer_->connect("foxglove.sdk.v1"));
    ASSERT_TRUE(viewer_->until([](const ViewerClient::Received& got) {
      return got.operation && got.operation->at("op") == "serverInfo" &&
             got.operation->at("name").get<std::string>().starts_with("perimap ");
    }));
    nlohmann::json subscriptions = nlohmann::json::array();
    ASSERT_TRUE(viewer_->until([&](const ViewerClient::Received& got) {
      if (!got.operation || got.operation->at("op") != "advertise") return false;
      for (const auto& channel : got.operation->at("channels")) {
        EXPECT_EQ(channel.at("encoding"), "cdr");
        EXPECT_EQ(channel.at("schemaEncoding"), "omgidl");
        EXPECT_THAT(channel.at("schema").get<std::string>(), HasSubstr("struct"));
        const std::uint32_t id = kFirstSubscription + static_cast<std::uint32_t>(topics_.size());
        topics_[id] = channel.at("topic");
        types_[channel.at("topic")] = channel.at("schemaName");
        subscriptions.push_back({{"id", id}, {"channelId", channel.at("id")}});
      }
      return true;
    }));
    EXPECT_EQ(types_, (std::map<std::string, std::string>{{"/surface/scene", "foxglove::SceneUpdate"},
                                                          {"/surface/worth", "perimap_view::SurfaceWorth"},
                                                          {"/transforms", "foxglove::FrameTransform"}}));
    viewer_->say({{"op", "subscribe"}, {"subscriptions", subscriptions}});
  }

  // Takes what comes apart; all that a scene shows is held against what was published for its instant.
  void take(const ViewerClient::Received& got) {
    if (got.operation && got.operation->at("op") == "status") words_ = got.operation->at("message");
    if (!got.message) return;
    const std::string& topic = topics_[got.message->subscription];
    const auto bytes = std::as_bytes(std::span(got.message->cdr));
    if (topic == "/surface/scene") {
      const auto scene = deserialize<foxglove_SceneUpdate>(bytes);
      ASSERT_TRUE(scene) << scene.error().message;
      hold(**scene, got.message->utc);
    } else if (topic == "/surface/worth") {
      const auto worth = deserialize<perimap_view_SurfaceWorth>(bytes);
      ASSERT_TRUE(worth) << worth.error().message;
      EXPECT_EQ(instant_of((*worth)->timestamp), got.message->utc);
      state_ = (*worth)->state;
      reason_ = (*worth)->reason;
      features_ = (*worth)->features;
    } else if (topic == "/transforms") {
      const auto camera = deserialize<foxglove_FrameTransform>(bytes);
      ASSERT_TRUE(camera) << camera.error().message;
      EXPECT_STREQ((*camera)->parent_frame_id, "tracker");
      EXPECT_STREQ((*camera)->child_frame_id, "camera");
      EXPECT_NEAR((*camera)->translation.x, 1e-3 * MadePublication::kCamera_mm[0], 1e-12);
      EXPECT_NEAR((*camera)->translation.y, 1e-3 * MadePublication::kCamera_mm[1], 1e-12);
      EXPECT_NEAR((*camera)->translation.z, 1e-3 * MadePublication::kCamera_mm[2], 1e-12);
      EXPECT_NEAR((*camera)->rotation.z, std::sqrt(0.5), 1e-9);
      EXPECT_NEAR((*camera)->rotation.w, std::sqrt(0.5), 1e-9);
      ++cameras_;
    } else {
      ADD_FAILURE() << "of subscription " << got.message->subscription;
    }
  }

  void hold(const foxglove_SceneUpdate& scene, Instant utc) {
    if (scene.entities._length == 0) {
      ASSERT_EQ(scene.deletions._length, 1U);
      EXPECT_EQ(scene.deletions._buffer[0].type, foxglove_ALL);
      ++cleared_;
      return;
    }
    const auto published = perimapd_.published_for(to_ns(utc));
    ASSERT_TRUE(published) << "nothing was published for this instant";
    EXPECT_NE(published->state, perimap_SURFACE_INVALID);
    const Instant valid = utc - Duration(MadePublication::kUtcMinusMonotonic_ns);
    for (const foxglove_SceneEntity& entity : std::span(scene.entities._buffer, scene.entities._length)) {
      EXPECT_EQ(instant_of(entity.timestamp), utc);
      EXPECT_STREQ(entity.frame_id, "tracker");
      EXPECT_EQ(entity.lifetime.sec, 0);
      EXPECT_EQ(entity.lifetime.nsec, 200'000'000U);
      for (const foxglove_TriangleListPrimitive& mesh : std::span(entity.triangles._buffer, entity.triangles._length))
        hold_mesh(mesh, valid);
      if (std::string_view(entity.id) == "tools") {
        hold_tools(entity);
      } else if (entity.spheres._length > 0) {
        hold_features(std::span(entity.spheres._buffer, entity.spheres._length), valid);
      }
    }
  }
  void hold_tools(const foxglove_SceneEntity& entity) {
    // After a silence what was told of it before it is too old, and nothing is drawn.
    if (entity.spheres._length == 0) {
      EXPECT_EQ(entity.lines._length + entity.texts._length, 0U);
      return;
    }
    ASSERT_EQ(entity.spheres._length, 1U);
    EXPECT_NEAR(entity.spheres._buffer[0].pose.position.x, 0.004, 1e-12);
    ASSERT_EQ(entity.lines._length, 1U);
    ASSERT_EQ(entity.lines._buffer[0].points._length, 2U);
    // The tip is at 97 mm, and 2 to 3 mm before the surface.
    EXPECT_GT(entity.lines._buffer[0].points._buffer[1].z, 0.099);
    EXPECT_LE(entity.lines._buffer[0].points._buffer[1].z, 0.1 + 1e-9);
    ASSERT_EQ(entity.texts._length, 1U);
    EXPECT_THAT(entity.texts._buffer[0].text, AnyOf(HasSubstr(test::kToolNow), HasSubstr(test::kToolBefore)));
    ++tools_;
  }
  void hold_mesh(const foxglove_TriangleListPrimitive& mesh, Instant valid) {
    ASSERT_EQ(mesh.points._length, 4U);  // the first vertex is uncertain
    ASSERT_EQ(mesh.indices._length, 6U);
    for (std::size_t v = 0; v < 4; ++v) {
      const auto expected = MadePublication::vertex_at(v + 1, valid);
      EXPECT_NEAR(mesh.points._buffer[v].x, 1e-3 * expected[0], 1e-7);
      EXPECT_NEAR(mesh.points._buffer[v].y, 1e-3 * expected[1], 1e-7);
      EXPECT_NEAR(mesh.points._buffer[v].z, 1e-3 * expected[2], 1e-7);
    }
    EXPECT_THAT(std::span(mesh.indices._buffer, 6), testing::ElementsAre(0, 1, 2, 1, 3, 2));
    ++meshes_;
  }
  void hold_features(std::span<const foxglove_SpherePrimitive> spheres, Instant valid) {
    ASSERT_EQ(spheres.size(), 3U);  // the fourth feature is invalid
    for (std::size_t i = 0; i < 3; ++i) {
      const auto expected = MadePublication::feature_at(i, valid);
      EXPECT_NEAR(spheres[i].pose.position.x, 1e-3 * expected[0], 1e-9);
      EXPECT_NEAR(spheres[i].pose.position.y, 1e-3 * expected[1], 1e-9);
      EXPECT_NEAR(spheres[i].pose.position.z, 1e-3 * expected[2], 1e-9);
    }
    ++scenes_;
  }

  // Until what has come meanwhile fulfils it.
  template <class Condition>
  [[nodiscard]] bool see(Condition condition) {
    return viewer_->until([&](const ViewerClient::Received& got) {
      take(got);
      return HasFailure() || condition();
    });
  }

  std::uint16_t port_ = 0;
  std::unique_ptr<ViewerClient> viewer_;
  std::map<std::uint32_t, std::string> topics_;                          // by subscription
  std::map<std::string, std::string> types_;                             // by topic
  std::string words_, state_, reason_;                                   // the last
  std::uint32_t features_ = 0;                                           // of the last worth
  int scenes_ = 0, meshes_ = 0, cleared_ = 0, cameras_ = 0, tools_ = 0;  // so many were held
};

TEST_F(BridgeFoxglove, WhatIsReceivedIsWhatWasPublishedAndAnInvalidSurfaceClearsIt) {
  ASSERT_NO_FATAL_FAILURE(open_viewer());
  ASSERT_TRUE(see([this] { return words_.find("no surface has come yet") != std::string::npos; }));
  EXPECT_EQ(scenes_, 0);

  perimapd_.open(domain_);
  ASSERT_TRUE(see([this] { return scenes_ >= 5 && meshes_ >= 5 && cameras_ >= 5 && tools_ >= 5; }));
  EXPECT_EQ(state_, "good");
  EXPECT_EQ(features_, 3U);
  EXPECT_THAT(words_, HasSubstr("may be used"));

  perimapd_.play({perimap_SURFACE_DEGRADED, perimap_SURFACE_REASON_POSE_MISSING, false});
  ASSERT_TRUE(see([this] { return state_ == "degraded"; }));
  EXPECT_EQ(reason_, "pose_missing");
  const int cameras_before = cameras_, scenes_before = scenes_;
  ASSERT_TRUE(see([&] { return scenes_ >= scenes_before + 5; }));
  EXPECT_EQ(cameras_, cameras_before) << "a camera whose place is not known";

  perimapd_.play({perimap_SURFACE_INVALID, perimap_SURFACE_REASON_PHASE_LOST});
  ASSERT_TRUE(see([this] { return state_ == "invalid"; }));
  EXPECT_EQ(reason_, "phase_lost");
  EXPECT_EQ(features_, 0U);
  const int shown_before = scenes_, cleared_before = cleared_;
  ASSERT_TRUE(see([&] { return cleared_ >= cleared_before + 3; }));
  EXPECT_EQ(scenes_, shown_before) << "nothing of an invalid surface";
  EXPECT_THAT(words_, HasSubstr("use no position"));

  perimapd_.play({});
  ASSERT_TRUE(see([&] { return scenes_ >= shown_before + 3; }));
  perimapd_.play({.silent = true});
  const int cleared_by_states = cleared_;
  ASSERT_TRUE(see([&] {
    return words_.find("nothing comes from perimapd") != std::string::npos && cleared_ > cleared_by_states;
  })) << words_;

  perimapd_.play({});
  const int until_silence = scenes_;
  ASSERT_TRUE(see([&] { return scenes_ >= until_silence + 3; }));
  const int cleared_by_silence = cleared_;
  program_->interrupt();
  bool ended = false;
  ASSERT_TRUE(viewer_->until([&](const ViewerClient::Received& got) {
    take(got);
    ended = !got.operation && !got.message;
    return ended;
  }));
  EXPECT_GT(cleared_, cleared_by_silence) << "its last word takes away what was shown";
  EXPECT_EQ(program_->ended(), 0);
}

TEST_F(BridgeFoxglove, WhatIsNotSubscribedToDoesNotCome) {
  ASSERT_NO_FATAL_FAILURE(open_viewer());
  perimapd_.open(domain_);
  ASSERT_TRUE(see([this] { return scenes_ >= 2; }));
  nlohmann::json all_but_worth = nlohmann::json::array();
  std::uint32_t worth = 0;
  for (const auto& [id, topic] : topics_) {
    if (topic == "/surface/worth") {
      worth = id;
    } else {
      all_but_worth.push_back(id);
    }
  }
  viewer_->say({{"op", "unsubscribe"}, {"subscriptionIds", all_but_worth}});
  // What was on its way comes still: of ten in a row none is another's then.
  int in_a_row = 0;
  ASSERT_TRUE(viewer_->until([&](const ViewerClient::Received& got) {
    if (got.message) in_a_row = got.message->subscription == worth ? in_a_row + 1 : 0;
    return in_a_row >= 10;
  }));
  int others = 0;
  static_cast<void>(viewer_->until(
      [&](const ViewerClient::Received& got) {
        if (got.message && got.message->subscription != worth) ++others;
        return false;
      },
      500ms));
  EXPECT_EQ(others, 0);
}

TEST_F(BridgeFoxglove, ADisorderlyViewerIsDroppedAndTheOthersGoOn) {
  ASSERT_NO_FATAL_FAILURE(open_viewer());
  ViewerClient of_another_protocol(port_);
  EXPECT_FALSE(of_another_protocol.connect("graphql-ws"));
  ViewerClient disorderly(port_);
  ASSERT_TRUE(disorderly.connect("foxglove.websocket.v1"));
  disorderly.say(nlohmann::json::array({1, 2, 3}));
  EXPECT_TRUE(disorderly.until([](const ViewerClient::Received& got) { return !got.operation && !got.message; }));
  perimapd_.open(domain_);
  EXPECT_TRUE(see([this] { return scenes_ >= 2; }));
}

}  // namespace
}  // namespace perimap
