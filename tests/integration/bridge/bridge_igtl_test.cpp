// `perimap bridge igtl` between a scripted perimapd and a client on libopenigtlink: what is received is what was
// published, value by value, and an invalid surface clears it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge_test.hpp"
#include "igtl_receiver.hpp"

namespace perimap {
namespace {

using namespace std::chrono_literals;
using test::IgtlReceived;
using test::MadePublication;
using test::ScriptedPerimapd;
using testing::HasSubstr;
using Code = igtl::StatusMessage;

// What a machine that is loaded adds to a time limit.
constexpr Duration kLoaded = std::chrono::milliseconds(1500);

class BridgeIgtl : public test::BridgeTest {
 protected:
  void start() {
    program_->start({"bridge", "igtl", "--domain", std::to_string(domain_), "--port", "0"});
    endpoint_ = program_->first_line();
    ASSERT_THAT(endpoint_, HasSubstr("127.0.0.1:")) << program_->said();
    port_ = std::stoi(endpoint_.substr(endpoint_.rfind(':') + 1));
    ASSERT_TRUE(client_.connect(port_));
  }

  // Takes what comes, each held against what was published, until it is what is waited for. Two minutes at most.
  template <class Wanted>
  [[nodiscard]] std::optional<IgtlReceived> until(Wanted wanted) {
    const Instant give_up = MonotonicClock::now() + 2min;
    while (MonotonicClock::now() < give_up) {
      auto got = client_.next();
      if (!got) return std::nullopt;
      check(*got);
      if (wanted(*got)) return got;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::optional<IgtlReceived> until_state(const std::string& device, int code) {
    return until(
        [&](const IgtlReceived& got) { return got.type == "STATUS" && got.device == device && got.code == code; });
  }

  void check(const IgtlReceived& got) {
    if (got.type == "POLYDATA" && got.device == "PerimapSurface" && !got.points.empty()) {
      ++surfaces_;
      const auto act = perimapd_.published_for(got.utc_ns);
      ASSERT_TRUE(act) << "nothing was published for " << got.utc_ns;
      ASSERT_NE(act->state, perimap_SURFACE_INVALID) << "of an invalid surface something has left";
      const Instant valid = from_ns(got.utc_ns - MadePublication::kUtcMinusMonotonic_ns);
      // Sent before its valid_until, and received at once on a machine that has the time.
      EXPECT_LT(MonotonicClock::now(), valid + 200ms + kLoaded);
      got.triangles.empty() ? check_features(got, valid) : check_mesh(got, valid);
    } else if (got.type == "POLYDATA" && got.device == "PerimapTools" && !got.points.empty()) {
      ++tips_;
      const auto act = perimapd_.published_for(got.utc_ns);
      ASSERT_TRUE(act && act->state != perimap_SURFACE_INVALID) << "of an invalid surface a tip has left";
      ASSERT_EQ(got.points.size(), 1U);
      EXPECT_THAT(got.points[0], testing::ElementsAre(4.0F, 5.0F, 97.0F));
      const float distance = got.scalars.at("distance_mm")[0];
      EXPECT_TRUE(distance > 2.0F && distance <= 3.0F) << distance;
    } else if (got.type == "TRANSFORM") {
      ++cameras_;
      const auto act = perimapd_.published_for(got.utc_ns + 50'000'000);  // of the capture
      ASSERT_TRUE(act);
      ASSERT_NE(act->state, perimap_SURFACE_INVALID);
      ASSERT_TRUE(act->camera);
      for (int row = 0; row < 3; ++row) {
        EXPECT_EQ(got.matrix[row][3], static_cast<float>(MadePublication::kCamera_mm[static_cast<std::size_t>(row)]));
      }
      EXPECT_NEAR(got.matrix[0][1], -1.0, 1e-6);
      EXPECT_NEAR(got.matrix[1][0], 1.0, 1e-6);
      EXPECT_NEAR(got.matrix[2][2], 1.0, 1e-6);
    }
  }
  static void check_point(const std::array<float, 3>& got, const std::array<double, 3>& expected, double within) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(static_cast<double>(got[axis]), expected[axis], within);
    }
  }
  void check_features(const IgtlReceived& got, Instant valid) {
    ++without_mesh_;
    ASSERT_EQ(got.points.size(), 1U);  // the one that has converged
    EXPECT_THAT(got.vertices, testing::ElementsAre(0U));
    // Single precision at 100 mm, and 50 ns of motion.
    check_point(got.points[0], MadePublication::feature_at(1, valid), 1e-5);
    EXPECT_NEAR(got.scalars.at("deviation_mm")[0], MadePublication::kFeatureDeviation_mm, 1e-6);
  }
  void check_mesh(const IgtlReceived& got, Instant valid) {
    ++with_mesh_;
    ASSERT_EQ(got.points.size(), 4U);
    EXPECT_THAT(got.triangles,
                testing::ElementsAre(std::array<std::uint32_t, 3>{0, 1, 2}, std::array<std::uint32_t, 3>{1, 3, 2}));
    for (std::size_t v = 0; v < 4; ++v) {
      check_point(got.points[v], MadePublication::vertex_at(v + 1, valid), 1e-4);
      EXPECT_NEAR(got.scalars.at("deviation_mm")[v], 0.2, 1e-6);
    }
  }

  std::string endpoint_;
  int port_ = 0;
  test::IgtlReceiver client_;
  int surfaces_ = 0, with_mesh_ = 0, without_mesh_ = 0, cameras_ = 0, tips_ = 0;
};

TEST_F(BridgeIgtl, WhatIsReceivedIsWhatWasPublishedAndAnInvalidSurfaceClearsIt) {
  start();
  const auto is_empty = [](const IgtlReceived& got) {
    return got.device == "PerimapSurface" && got.type == "POLYDATA" && got.points.empty();
  };
  const auto has_points = [](const IgtlReceived& got) {
    return got.device == "PerimapSurface" && got.type == "POLYDATA" && !got.points.empty();
  };
  ASSERT_TRUE(until(is_empty));
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_NOT_PRESENT));
  ASSERT_TRUE(program_->says("nobody publishes in DDS domain " + std::to_string(domain_)));

  perimapd_.open(domain_);
  // It listens for a second whether there is one publisher, and three to its meshes.
  const auto listening = until_state("PerimapSurface", Code::STATUS_DISABLED);
  ASSERT_TRUE(listening);
  EXPECT_THAT(listening->words, HasSubstr("listening whether there is one publisher"));
  EXPECT_EQ(surfaces_, 0);
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_OK));
  ASSERT_TRUE(until([](const IgtlReceived& got) { return !got.triangles.empty(); }));
  EXPECT_GT(without_mesh_, 10);
  EXPECT_GT(cameras_, 10);
  EXPECT_GT(tips_, 5);
  ASSERT_TRUE(until([](const IgtlReceived& got) {
    return got.type == "STRING" && (got.words == test::kToolNow || got.words.find(test::kToolBefore) == 0);
  }));

  perimapd_.play({perimap_SURFACE_DEGRADED, perimap_SURFACE_REASON_POSE_MISSING, false});
  const auto degraded = until_state("PerimapSurface", Code::STATUS_NOT_READY);
  ASSERT_TRUE(degraded);
  EXPECT_EQ(degraded->name, "degraded");
  EXPECT_EQ(degraded->sub_code, perimap_SURFACE_REASON_POSE_MISSING);
  EXPECT_THAT(degraded->words, HasSubstr("no pose of the scope"));
  ASSERT_TRUE(until_state("PerimapCamera", Code::STATUS_NOT_FOUND));
  ASSERT_TRUE(until(has_points));

  perimapd_.play({perimap_SURFACE_INVALID, perimap_SURFACE_REASON_PHASE_LOST});
  ASSERT_TRUE(until(is_empty));
  const auto invalid = until_state("PerimapSurface", Code::STATUS_DISABLED);
  ASSERT_TRUE(invalid);
  EXPECT_EQ(invalid->name, "invalid");
  EXPECT_THAT(invalid->words, HasSubstr("no heart beat for too long"));
  const int before = surfaces_, tips_before = tips_;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(until(is_empty));
  EXPECT_EQ(surfaces_, before);
  EXPECT_EQ(tips_, tips_before);
  ASSERT_TRUE(until([](const IgtlReceived& got) {
    return got.type == "STRING" && got.words == "instrument/probe: the surface is not good";
  }));

  perimapd_.play({});
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_OK));
  ASSERT_TRUE(until(has_points));
  const Instant silent_from = MonotonicClock::now();
  perimapd_.play({.silent = true});
  ASSERT_TRUE(until(is_empty));
  EXPECT_LT(MonotonicClock::now() - silent_from, 250ms + kLoaded);
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_TIME_OUT));
  EXPECT_TRUE(program_->says("nothing has come from perimapd"));

  perimapd_.play({});
  ASSERT_TRUE(until(has_points));
  EXPECT_TRUE(program_->says("surfaces come again"));
  program_->interrupt();
  ASSERT_TRUE(until(is_empty));
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_SHUT_DOWN));
  ASSERT_TRUE(until_state("PerimapCamera", Code::STATUS_SHUT_DOWN));
  EXPECT_FALSE(client_.next(2s)) << "nothing comes after the last word";
  EXPECT_EQ(program_->ended(), 0);
  RecordProperty("surfaces", surfaces_);
  EXPECT_GT(with_mesh_, 5);
}

TEST_F(BridgeIgtl, OfTwoPublishersUnderOneNameNothingIsUsed) {
  start();
  perimapd_.open(domain_);
  ASSERT_TRUE(until_state("PerimapSurface", Code::STATUS_OK));
  ScriptedPerimapd another;
  another.open(domain_);
  const auto two = until([](const IgtlReceived& got) {
    return got.device == "PerimapSurface" && got.words.find("TWO PUBLISHERS") != std::string::npos;
  });
  ASSERT_TRUE(two);
  EXPECT_EQ(two->code, Code::STATUS_DISABLED);
  const int before = surfaces_;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(until([](const IgtlReceived& got) { return got.type == "POLYDATA"; }));
  }
  EXPECT_EQ(surfaces_, before);
}

TEST_F(BridgeIgtl, APortInUseIsToldWithWhatToDo) {
  start();
  test::BridgeProgram second((folder_ / "second").string());
  second.start({"bridge", "igtl", "--domain", std::to_string(domain_), "--port", std::to_string(port_)});
  EXPECT_EQ(second.first_line(), "");
  EXPECT_EQ(second.ended(), 1);
  EXPECT_THAT(second.said(), HasSubstr("cannot listen on 127.0.0.1 port " + std::to_string(port_)));
  EXPECT_THAT(second.said(), HasSubstr("choose another --port"));
}

}  // namespace
}  // namespace perimap
