#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "made_tool.hpp"
#include "perimap_publisher_watch.hpp"

namespace perimap::client {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod = 16 * kMs;

// What one program publishes.
class Program {
 public:
  Program(std::uint8_t run, std::uint64_t writer) : writer_(writer) {
    surface_.run_id[0] = run;
    surface_.features = {1, 1, &feature_, false};
  }

  Hearing speak(PublisherWatch& watch, std::int64_t now_ns) {
    ++surface_.sample_sequence;
    surface_.capture_time_ns = now_ns - 50 * kMs;
    surface_.release_time_ns = now_ns - kMs;
    surface_.valid_until_ns = now_ns + 200 * kMs;
    return watch.hear(surface_, writer_, now_ns);
  }
  // From `from` to `until`; the last answer.
  Hearing speak_for(PublisherWatch& watch, std::int64_t from, std::int64_t until) {
    Hearing heard = Hearing::kListening;
    for (std::int64_t t = from; t <= until; t += kPeriod) heard = speak(watch, t);
    return heard;
  }
  perimap_Surface& surface() { return surface_; }
  perimap_SurfaceFeature& feature() { return feature_; }

 private:
  std::uint64_t writer_;
  perimap_SurfaceFeature feature_{};
  perimap_Surface surface_{};
};

class Watching : public ::testing::Test {
 protected:
  // A program that has been heard for five seconds, and is used.
  Watching() { begun_ = a_.speak_for(watch_, 0, 5'000 * kMs); }

  PublisherWatch watch_;
  Program a_{1, 11};
  Hearing begun_ = Hearing::kListening;
  std::int64_t now_ = 5'000 * kMs;
};

TEST(PublisherWatchBegin, NothingIsUsedInTheFirstSecond) {
  PublisherWatch watch;
  Program a(1, 11);
  for (std::int64_t t = 0; t < 1'000 * kMs; t += kPeriod) ASSERT_EQ(a.speak(watch, t), Hearing::kListening) << t;
  EXPECT_EQ(a.speak(watch, 1'000 * kMs), Hearing::kUse);
}

TEST_F(Watching, OnePublisherIsUsed) {
  EXPECT_EQ(begun_, Hearing::kUse);
  EXPECT_EQ(watch_.state(now_), Hearing::kUse);
}

TEST_F(Watching, ARestartIsUsedASecondAfterItBegan) {
  Program again(2, 22);
  EXPECT_EQ(again.speak(watch_, now_ + 400 * kMs), Hearing::kAnotherBegan);
  EXPECT_EQ(again.speak_for(watch_, now_ + 416 * kMs, now_ + 1'390 * kMs), Hearing::kAnotherBegan);
  EXPECT_EQ(again.speak(watch_, now_ + 1'410 * kMs), Hearing::kUse);
}

// Who asks may have been busy: that nothing was heard does not say that nothing was sent.
TEST_F(Watching, AfterAPauseAnotherIsNotUsedAtOnce) {
  Program b(2, 22);
  EXPECT_EQ(b.speak(watch_, now_ + 30'000 * kMs), Hearing::kAnotherBegan);
  EXPECT_EQ(a_.speak(watch_, now_ + 30'001 * kMs), Hearing::kTwoPublishers);
}

// A reader of depth 16, taken once in two seconds: the samples of both at one instant, in turn.
TEST_F(Watching, OfTwoThatComeInOneBatchNoneOfTheSecondIsUsed) {
  Program b(2, 22);
  for (int batch = 1; batch < 20; ++batch) {
    const std::int64_t t = now_ + batch * 2'000 * kMs;
    for (int i = 0; i < 16; ++i) {
      EXPECT_NE(b.speak(watch_, t), Hearing::kUse) << batch << ", " << i;
      EXPECT_NE(a_.speak(watch_, t), Hearing::kUse) << batch << ", " << i;
    }
  }
}

// The run is public: whoever copies it can be the first in a topic that has not been heard yet.
TEST_F(Watching, AForgedFirstSampleOfANewTopicIsNotUsedAndToldWhenTheTrueOneComes) {
  perimap_SurfaceMesh forged{};
  forged.run_id[0] = 1;
  perimap_SurfaceMesh mesh = forged;
  for (int i = 1; i < 60; ++i) {
    const std::int64_t now = now_ + i * kPeriod;
    EXPECT_EQ(a_.speak(watch_, now), Hearing::kUse) << "what was known goes on";
    if (i % 10 != 0) continue;
    ++forged.sample_sequence;
    forged.time_ns = now;
    EXPECT_EQ(watch_.hear(forged, 99, now), Hearing::kListening);
  }
  ++mesh.sample_sequence;
  mesh.time_ns = now_ + 961 * kMs;
  EXPECT_NE(watch_.hear(mesh, 14, now_ + 961 * kMs), Hearing::kUse);
  EXPECT_NE(watch_.hear(forged, 99, now_ + 962 * kMs), Hearing::kUse);
  EXPECT_EQ(watch_.state(now_ + 962 * kMs), Hearing::kTwoPublishers);
}

TEST_F(Watching, WhatPerimapdItselfSaysOfTwoCounts) {
  perimap_Status status{};
  status.run_id[0] = 1;
  status.sample_sequence = 1;
  status.time_ns = now_;
  status.two_publishers = true;
  EXPECT_EQ(watch_.hear(status, 13, now_), Hearing::kTwoPublishers);
  EXPECT_EQ(a_.speak(watch_, now_ + kPeriod), Hearing::kTwoPublishers);
  EXPECT_EQ(a_.speak_for(watch_, now_ + 2 * kPeriod, now_ + 990 * kMs), Hearing::kTwoPublishers);
  EXPECT_EQ(a_.speak(watch_, now_ + 1'010 * kMs), Hearing::kUse);
}

// Whatever the second one copies: its own run, the run of the first, its sequence numbers.
TEST_F(Watching, TwoPublishersAreToldWithinTwoSamplesAndNeitherIsUsedIn100Of100Tries) {
  std::mt19937 random(std::random_device{}());
  for (int trial = 0; trial < 100; ++trial) {
    PublisherWatch watch;
    Program a(1, 11);
    ASSERT_EQ(a.speak_for(watch, 0, 2'000 * kMs), Hearing::kUse);
    Program b(trial % 2 == 0 ? 7 : 1, 77);
    b.surface().sample_sequence = trial % 4 < 2 ? a.surface().sample_sequence : 14'000'000;
    const std::int64_t phase = static_cast<std::int64_t>(random() % kPeriod);
    const std::int64_t period = kPeriod / 2 + static_cast<std::int64_t>(random() % (8 * kPeriod));
    std::int64_t next_a = 2'000 * kMs + kPeriod;
    std::int64_t next_b = next_a + phase;
    int heard_since_b = -1;
    int told_after = -1;
    for (int i = 0; i < 500; ++i) {
      const bool of_b = next_b < next_a;
      const std::int64_t now = of_b ? next_b : next_a;
      const Hearing heard = (of_b ? b : a).speak(watch, now);
      (of_b ? next_b : next_a) += of_b ? period : kPeriod;
      if (of_b && heard_since_b < 0) heard_since_b = 0;
      if (heard_since_b < 0) continue;
      ++heard_since_b;
      ASSERT_NE(heard, Hearing::kUse) << "trial " << trial << ", sample " << heard_since_b << " since the second began";
      if (heard == Hearing::kTwoPublishers && told_after < 0) told_after = heard_since_b;
    }
    EXPECT_GT(told_after, 0) << trial;
    // Its own first one, those of its own that come before the first's next, and that.
    EXPECT_LE(told_after, 2 + kPeriod / period) << trial;
  }
}

TEST_F(Watching, OneThatGoesOnAloneIsUsedAfterASecond) {
  Program b(2, 22);
  for (int i = 1; i <= 100; ++i) {
    EXPECT_NE(b.speak(watch_, now_ + i * kPeriod), Hearing::kUse);
    EXPECT_NE(a_.speak(watch_, now_ + i * kPeriod + kMs), Hearing::kUse);
  }
  const std::int64_t since = now_ + 100 * kPeriod;
  EXPECT_EQ(a_.speak_for(watch_, since + kPeriod, since + 990 * kMs), Hearing::kTwoPublishers);
  EXPECT_EQ(a_.speak(watch_, since + 1'020 * kMs), Hearing::kUse);
}

TEST(PublisherWatchBegin, ASubscriberThatComesToTwoUsesNeitherFromTheBeginning) {
  PublisherWatch watch;
  Program a(1, 11);
  Program b(2, 22);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_NE(b.speak(watch, i * kPeriod), Hearing::kUse);
    ASSERT_NE(a.speak(watch, i * kPeriod + 8 * kMs), Hearing::kUse);
  }
}

TEST_F(Watching, OneThatSpeaksOnceASecondKeepsBothFromBeingUsed) {
  Program b(2, 22);
  int used = 0;
  for (int i = 1; i < 600; ++i) {
    used += a_.speak(watch_, now_ + i * kPeriod) == Hearing::kUse ? 1 : 0;
    if (i % 60 != 1) continue;
    EXPECT_NE(b.speak(watch_, now_ + i * kPeriod + kMs), Hearing::kUse);
  }
  EXPECT_LE(used, 1) << "the one before the second was heard";
}

TEST_F(Watching, SequenceJumpsAndStepsBackAreRefusedAndGapsOfAPauseAreNot) {
  a_.surface().sample_sequence += 100;
  EXPECT_EQ(a_.speak(watch_, now_ + 1'600 * kMs), Hearing::kUse) << "a pause of the reader";
  a_.surface().sample_sequence += 14'000'000;
  EXPECT_EQ(a_.speak(watch_, now_ + 1'616 * kMs), Hearing::kImplausible);
  EXPECT_EQ(a_.speak_for(watch_, now_ + 1'632 * kMs, now_ + 2'600 * kMs), Hearing::kImplausible);
  EXPECT_EQ(a_.speak(watch_, now_ + 2'630 * kMs), Hearing::kUse) << "it has gone on from there for a second";
  a_.surface().sample_sequence -= 5;
  EXPECT_EQ(a_.speak(watch_, now_ + 2'646 * kMs), Hearing::kImplausible);
}

TEST_F(Watching, TimeJumpsAreRefused) {
  perimap_Surface& surface = a_.surface();
  for (const std::int64_t jump :
       {std::int64_t{6'000}, std::int64_t{-6'000}, std::int64_t{31'536'000'000}, std::int64_t{-9'223'372'036'854}}) {
    PublisherWatch watch;
    Program a(1, 1);
    ASSERT_EQ(a.speak_for(watch, 0, 2'000 * kMs), Hearing::kUse);
    surface = a.surface();
    ++surface.sample_sequence;
    surface.release_time_ns += jump * kMs;
    surface.capture_time_ns = surface.release_time_ns - 1;
    surface.valid_until_ns = surface.release_time_ns + 1;
    EXPECT_EQ(watch.hear(surface, 1, 2'016 * kMs), Hearing::kImplausible) << jump;
  }
}

TEST_F(Watching, FiguresThatAreNoNumbersAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<double*> figures = {&a_.feature().position_W_mm[2], &a_.feature().velocity_W_mm_per_s[0],
                                  &a_.feature().covariance_W_mm2[5], &a_.surface().cardiac_phase_rad};
  std::int64_t t = now_;
  for (double* figure : figures) {
    for (const double wrong : {nan, infinite, -infinite}) {
      ASSERT_EQ(a_.speak_for(watch_, t + kPeriod, t + 1'100 * kMs), Hearing::kUse);
      t += 1'100 * kMs;
      *figure = wrong;
      EXPECT_EQ(a_.speak(watch_, t + kPeriod), Hearing::kImplausible);
      *figure = 1.0;
      t += kPeriod;
    }
  }
}

// Each topic has a writer of its own; the run is one.
TEST_F(Watching, TheTopicsOfOneProgramAreOnePublisherAndAForgedModelIsNoticedBesideThem) {
  perimap_SurfaceModel model{};
  model.run_id[0] = 1;
  perimap_Status status{};
  status.run_id[0] = 1;
  perimap_SurfaceMesh mesh{};
  mesh.run_id[0] = 1;
  const auto next = [&](std::int64_t now) {
    ++model.sample_sequence;
    ++status.sample_sequence;
    ++mesh.sample_sequence;
    model.time_ns = status.time_ns = mesh.time_ns = now;
    model.valid_from_ns = now;
    model.valid_until_ns = now + 1;
  };
  for (int i = 1; i <= 400; ++i) {
    const std::int64_t now = now_ + i * 10 * kMs;
    next(now);
    const auto settled = [&](std::int64_t since_ms) {
      return 10 * (i - 1) >= since_ms ? Hearing::kUse : Hearing::kListening;
    };
    EXPECT_EQ(a_.speak(watch_, now), Hearing::kUse);
    EXPECT_EQ(watch_.hear(model, 12, now), settled(1'000)) << i;
    EXPECT_EQ(watch_.hear(status, 13, now), Hearing::kUse) << "it has no positions";
    EXPECT_EQ(watch_.hear(mesh, 14, now), settled(3'000)) << i;
  }
  next(now_ + 4'005 * kMs);
  perimap_SurfaceModel forged = model;
  EXPECT_NE(watch_.hear(forged, 99, now_ + 4'005 * kMs), Hearing::kUse);
  EXPECT_NE(watch_.hear(model, 12, now_ + 4'006 * kMs), Hearing::kUse);
  EXPECT_EQ(watch_.state(now_ + 4'007 * kMs), Hearing::kTwoPublishers);
}

// What a tool is said to be is acted on as a surface is.
TEST_F(Watching, EachToolIsAStreamOfItsOwnAndAForgedOneIsNoticed) {
  std::uint64_t sequence = 0;
  const auto tell = [&](const char* name, std::uint64_t writer, std::int64_t now) {
    return watch_.hear(test::made_tool(now, name, sequence), writer, now);
  };
  for (int i = 1; i <= 200; ++i) {
    const std::int64_t now = now_ + i * 10 * kMs;
    ++sequence;
    EXPECT_EQ(a_.speak(watch_, now), Hearing::kUse);
    const Hearing expected = i > 100 ? Hearing::kUse : Hearing::kListening;
    EXPECT_EQ(tell("pointer", 15, now), expected) << i;
    EXPECT_EQ(tell("instrument/probe", 15, now), expected) << i;
  }
  const std::int64_t now = now_ + 2'005 * kMs;
  EXPECT_NE(tell("instrument/probe", 99, now), Hearing::kUse);
  ++sequence;
  EXPECT_NE(tell("instrument/probe", 15, now + kMs), Hearing::kUse);
  EXPECT_EQ(watch_.state(now + 2 * kMs), Hearing::kTwoPublishers);
}

TEST_F(Watching, MoreToolsInTurnThanThereAreLanesAreFollowedAsFarAsAnybodyCan) {
  for (int i = 0; i < 400; ++i) {
    const std::int64_t now = now_ + i * 10 * kMs;
    a_.speak(watch_, now);
    const std::string name = "instrument/" + std::to_string(i % 40);
    watch_.hear(test::made_tool(now, name, static_cast<std::uint64_t>(i / 40 + 1)), 15, now);
  }
  EXPECT_EQ(watch_.state(now_ + 4'000 * kMs), Hearing::kUse);
}

TEST_F(Watching, AToolWhoseNumbersAreNoneIsImplausible) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::int64_t t = now_;
  std::uint64_t sequence = 0;
  const auto after = [&](auto spoil) {
    EXPECT_EQ(a_.speak_for(watch_, t + kPeriod, t + 2'100 * kMs), Hearing::kUse);
    t += 2'100 * kMs + kPeriod;
    perimap_ToolDistance tool = test::made_tool(t, "pointer", ++sequence);
    spoil(tool);
    return watch_.hear(tool, 15, t);
  };
  after([](perimap_ToolDistance&) {});
  EXPECT_EQ(after([](perimap_ToolDistance&) {}), Hearing::kUse);
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) { tool.distances_mm[0] = nan; }), Hearing::kImplausible);
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) { tool.deviations_mm[2] = -1.0; }), Hearing::kImplausible);
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) { tool.tip_W_mm[1] = nan; }), Hearing::kImplausible);
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) { tool.states[1] = 7; }), Hearing::kImplausible);
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) { tool.valid_until_ns = 0; }), Hearing::kImplausible);
  // What is told as not known is no number, and harms nobody.
  EXPECT_EQ(after([&](perimap_ToolDistance& tool) {
              tool.states[2] = perimap_TOOL_INVALID;
              tool.distances_mm[2] = nan;
            }),
            Hearing::kUse);
}

TEST(PublisherWatchWords, AreThereForEveryAnswer) {
  for (const Hearing hearing :
       {Hearing::kUse, Hearing::kListening, Hearing::kAnotherBegan, Hearing::kTwoPublishers, Hearing::kImplausible}) {
    EXPECT_GT(std::string(describe(hearing)).size(), 8U);
  }
}

}  // namespace
}  // namespace perimap::client
