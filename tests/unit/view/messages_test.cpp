#include "daemon/view/messages/messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "daemon/dds/bounded_string.hpp"
#include "daemon/publishing/advice.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "daemon/subscribing/followed_publisher.hpp"
#include "daemon/view/messages/page_request.hpp"
#include "daemon/view/messages/surface_teller.hpp"
#include "made_publication.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;

TEST(PageRequest, IsAnInstantOfTheRecording) {
  const auto request = parse_page_request(R"({"at_s": 12.5, "from_here": true})");
  ASSERT_TRUE(request) << request.error().message;
  EXPECT_EQ(request->at_s, 12.5);
  EXPECT_TRUE(request->from_here);
  EXPECT_FALSE(parse_page_request(R"({"at_s": 0})")->from_here);
}

TEST(PageRequest, WhatIsGarbledIsRefused) {
  for (const std::string text :
       {"", "{", "null", "[]", "12.5", "{}", R"({"at_s": "1"})", R"({"at_s": 1e999})", R"({"at_s": -1e300})",
        R"({"at_s": 1, "from_here": 1})", R"({"at_s": 1} {)", "\xFF\xFE", R"({"at_s": null})"}) {
    EXPECT_FALSE(parse_page_request(text)) << text;
  }
  EXPECT_FALSE(parse_page_request(std::string(1000, '[')));
}

TEST(Guidance, IsToldWithThePartsOfThePicture) {
  std::string line = "12 views; show it left";
  std::vector<std::uint8_t> seen{0, 100, 40, 100, 100, 100};
  perimap_Guidance guidance{};
  dds::assign(guidance.what, "calibrate camera");
  guidance.line = line.data();
  guidance.columns = 3, guidance.rows = 2;
  guidance.seen_percent._buffer = seen.data();
  guidance.seen_percent._length = static_cast<std::uint32_t>(seen.size());
  auto told = guidance_json(guidance);
  EXPECT_EQ(told["what"], "calibrate camera");
  EXPECT_EQ(told["line"], line);
  EXPECT_EQ(told["stage"], "recording");
  EXPECT_EQ(told["seen_percent"], (std::vector<int>{0, 100, 40, 100, 100, 100}));
  guidance.stage = perimap_GUIDANCE_RECORDED;
  EXPECT_EQ(guidance_json(guidance)["stage"], "recorded");

  // Another's sample: as many parts as are not there.
  guidance.rows = 200;
  told = guidance_json(guidance);
  EXPECT_EQ(told["columns"], 0);
  EXPECT_TRUE(told["seen_percent"].empty());
  EXPECT_EQ(guidance_json({})["line"], "");
}

TEST(Advice, EveryReasonOfTheIdlHasAWayOutAndNoneButNoneHasNone) {
  EXPECT_EQ(remedy_of(perimap_SURFACE_REASON_NONE), "");
  int reasons = 0;
  for (int i = 1; name_of(static_cast<perimap_SurfaceReason>(i)) != "unknown"; ++i, ++reasons) {
    const auto remedy = remedy_of(static_cast<perimap_SurfaceReason>(i));
    EXPECT_NE(remedy, "") << i;
    EXPECT_NE(remedy, remedy_of(static_cast<perimap_SurfaceReason>(31))) << i;
  }
  EXPECT_GE(reasons, 22);
}

TEST(Advice, OnlyKnownStatesPermitAnything) {
  EXPECT_EQ(permission_of(perimap_SURFACE_GOOD), "may be used");
  EXPECT_EQ(permission_of(perimap_SURFACE_DEGRADED), "use with care");
  EXPECT_EQ(permission_of(perimap_SURFACE_INVALID), "use no position");
  EXPECT_EQ(permission_of(static_cast<perimap_SurfaceState>(3)), "use no position");
}

perimap_SurfaceFeature feature_at(std::uint32_t id, perimap_FeatureState state, double x) {
  perimap_SurfaceFeature feature{};
  feature.id = id;
  feature.state = state;
  feature.position_W_mm[0] = x;
  feature.covariance_W_mm2[0] = 0.04;
  feature.covariance_W_mm2[3] = feature.covariance_W_mm2[5] = 0.01;
  return feature;
}

struct Told {
  explicit Told(perimap_SurfaceState state) {
    features = {feature_at(3, perimap_FEATURE_CONVERGED, 1.0), feature_at(4, perimap_FEATURE_INVALID, 2.0),
                feature_at(7, perimap_FEATURE_CONVERGED, std::numeric_limits<double>::quiet_NaN()),
                feature_at(9, perimap_FEATURE_CONVERGING, 4.0)};
    surface.state = state;
    surface.reason = perimap_SURFACE_REASON_POSE_MISSING;
    surface.features._buffer = features.data();
    surface.features._length = surface.features._maximum = static_cast<std::uint32_t>(features.size());
    surface.valid_until_ns = 100;
  }
  std::vector<perimap_SurfaceFeature> features;
  perimap_Surface surface{};
};

TEST(SurfaceTeller, TellsUsableFeaturesWithTheirLargestDeviation) {
  Told told(perimap_SURFACE_DEGRADED);
  const auto json = SurfaceTeller().tell(told.surface, from_ns(50));
  EXPECT_EQ(json["state"], "degraded");
  EXPECT_EQ(json["reason"], "pose_missing");
  EXPECT_EQ(json["converged"], 1);  // the other one has no position
  EXPECT_EQ(json["known"], 4);
  EXPECT_NEAR(json["valid_for_ms"].get<double>(), 50e-6, 1e-9);
  EXPECT_EQ(json["features"]["ids"], nlohmann::ordered_json({3, 9}));
  EXPECT_EQ(json["features"]["positions_mm"], nlohmann::ordered_json({1.0, 0.0, 0.0, 4.0, 0.0, 0.0}));
  EXPECT_EQ(json["features"]["deviations_mm"][0], 0.2);
  EXPECT_EQ(json["camera"], nullptr);
  EXPECT_EQ(json["mesh"]["words"], "no surface has come yet");
  EXPECT_LT(SurfaceTeller().tell(told.surface, from_ns(101))["valid_for_ms"], 0.0);
  told.surface.camera_pose_known = true;
  told.surface.rotation_WC_wxyz[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(SurfaceTeller().tell(told.surface, from_ns(50))["camera"], nullptr);
}

TEST(SurfaceTeller, TellsEachUseAndOfAnOlderPerimapdNone) {
  Told told(perimap_SURFACE_DEGRADED);
  EXPECT_EQ(SurfaceTeller().tell(told.surface, from_ns(50))["uses"], nullptr);
  told.surface.display_state = perimap_SURFACE_GOOD;
  told.surface.contact_state = perimap_SURFACE_INVALID;
  told.surface.use_within_mm[0] = 5.0;
  told.surface.use_features[0] = 31;
  const auto uses = SurfaceTeller().tell(told.surface, from_ns(50))["uses"];
  EXPECT_EQ(uses["display"], (nlohmann::ordered_json{{"state", "good"}, {"within_mm", 5.0}, {"features", 31}}));
  EXPECT_EQ(uses["contact"]["state"], "invalid");
}

TEST(SurfaceTeller, OfAnInvalidSurfaceNoPositionLeaves) {
  for (const auto state : {perimap_SURFACE_INVALID, static_cast<perimap_SurfaceState>(3)}) {
    Told told(state);
    told.surface.camera_pose_known = true;
    const auto json = SurfaceTeller().tell(told.surface, from_ns(50));
    EXPECT_FALSE(json.contains("features"));
    EXPECT_FALSE(json.contains("mesh"));
    EXPECT_FALSE(json.contains("camera"));
    EXPECT_EQ(json["permission"], "use no position");
  }
}

// The model was made 0.3 s after a beat that it knows; the surface has heard of a newer one.
TEST(SurfaceTeller, MovesTheMeshByTheSurfacesOwnPhase) {
  const Instant now = from_ns(0) + 100s + 300ms;
  test::MadePublication made;
  SurfaceTeller teller;
  teller.hear(test::owned(made.model_at(now, 1)));
  teller.hear(test::owned(made.mesh_at(now, 1)));
  perimap_Surface& surface = made.surface_at(now, 7);
  surface.cardiac_phase_rad = 0.0;
  const auto json = teller.tell(surface, now);
  EXPECT_EQ(json["mesh"]["state"], "good") << json["mesh"];
  const double z_mm = json["mesh"]["positions_mm"][5];
  EXPECT_NEAR(z_mm, test::MadePublication::vertex_at(1, from_ns(0) + 100s)[2], 0.01);
  EXPECT_GT(std::abs(z_mm - test::MadePublication::vertex_at(1, now)[2]), 1.0);
}

TEST(Messages, TextOfAPublisherThatIsNoUtf8IsStillJson) {
  Told told(perimap_SURFACE_GOOD);
  told.surface.source[0] = '\xFF';
  const PageMessage message = text_message(SurfaceTeller().tell(told.surface, from_ns(50)));
  EXPECT_TRUE(nlohmann::json::accept(*message.bytes));
}

using Verdict = FollowedPublisher::Verdict;

TEST(FollowedPublisher, TwoAreNeverMixed) {
  FollowedPublisher followed;
  EXPECT_FALSE(followed.follows(1));
  EXPECT_EQ(followed.surface(1, "frame", from_ns(0)), Verdict::kNew);
  EXPECT_EQ(followed.surface(2, "frame", from_ns(0) + 10ms), Verdict::kOther);
  EXPECT_EQ(followed.surface(1, "frame", from_ns(0) + 33ms), Verdict::kSame);
  EXPECT_TRUE(followed.follows(1));
  EXPECT_FALSE(followed.follows(2));
}

TEST(FollowedPublisher, AnotherIsFollowedOnceTheFirstIsSilent) {
  FollowedPublisher followed;
  EXPECT_EQ(followed.surface(1, "frame", from_ns(0)), Verdict::kNew);
  EXPECT_EQ(followed.surface(2, "frame", from_ns(0) + 900ms), Verdict::kOther);
  EXPECT_EQ(followed.surface(2, "frame", from_ns(0) + 1100ms), Verdict::kNew);
  EXPECT_EQ(followed.surface(1, "frame", from_ns(0) + 1200ms), Verdict::kOther);
  EXPECT_TRUE(followed.follows(2, "frame"));
}

TEST(FollowedPublisher, OfTwoStreamsTheFramesIsShown) {
  FollowedPublisher followed;
  EXPECT_EQ(followed.surface(1, "clock", from_ns(0)), Verdict::kNew);
  EXPECT_EQ(followed.surface(1, "frame", from_ns(0) + 1ms), Verdict::kNew);
  EXPECT_EQ(followed.surface(1, "clock", from_ns(0) + 2ms), Verdict::kOther);
  EXPECT_TRUE(followed.follows(1, "frame"));
  EXPECT_FALSE(followed.follows(1, "clock"));
}

}  // namespace
}  // namespace perimap
