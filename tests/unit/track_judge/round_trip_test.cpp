#include "daemon/evaluation/track_judge/round_trip.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>

namespace perimap {
namespace {

constexpr std::size_t kTurn = 10;

// There and back by one pixel a frame, ending `off_px` beside where it began.
Track there_and_back(double off_px = 0) {
  Track track(2 * kTurn + 1);
  for (std::size_t k = 0; k < track.size(); ++k) {
    const double along = static_cast<double>(std::min(k, 2 * kTurn - k));
    track[k] = Vector2d(100 + along + (k > kTurn ? off_px : 0), 50);
  }
  return track;
}

TripFigures judge(const Track& track, std::optional<Vector2d> at_turn = std::nullopt, int width = 1280) {
  std::map<std::uint32_t, Vector2d> reference;
  if (at_turn) reference.emplace(7, *at_turn);
  return judge_round_trip({{7, track}}, kTurn, width, reference);
}

TEST(RoundTrip, ATrackThatReturnsIsRightAndOneBesideItIsNot) {
  EXPECT_EQ(judge(there_and_back()).right, 1U);
  EXPECT_EQ(judge(there_and_back(2.9)).right, 1U);
  const TripFigures beside = judge(there_and_back(3.1));
  EXPECT_EQ(beside.right, 0U);
  EXPECT_EQ(beside.alive, 1U);
  EXPECT_EQ(beside.off, 0U);
  EXPECT_EQ(judge(there_and_back(5.1)).off, 1U);
  EXPECT_NEAR(judge(there_and_back(5.1)).median_px, 5.1, 1e-9);
}

TEST(RoundTrip, LengthsGoWithThePicturesWidth) {
  EXPECT_EQ(judge(there_and_back(0.7), std::nullopt, 256).right, 0U);
  EXPECT_EQ(judge(there_and_back(0.5), std::nullopt, 256).right, 1U);
}

TEST(RoundTrip, StandingStillIsNotRight) {
  Track still(2 * kTurn + 1);
  for (auto& px : still) px = Vector2d(100, 50);
  EXPECT_EQ(judge(still).right, 1U);  // as far as the return alone tells
  const TripFigures figures = judge(still, Vector2d(110, 50));
  EXPECT_EQ(figures.right, 0U);
  EXPECT_EQ(figures.verdicts.at(7), TripVerdict::kStrayed);
}

TEST(RoundTrip, WhatIsAwayAtTheTurnAndFoundAgainIsNotRightWhereTheOtherStillHadIt) {
  Track track = there_and_back();
  track[kTurn].reset();
  EXPECT_EQ(judge(track, Vector2d(110, 50)).right, 0U);
  EXPECT_EQ(judge(track).right, 1U);
}

TEST(RoundTrip, CountsOnlyWhatBeginsInTheFirstFramesAndIsThereInTheLast) {
  Track late = there_and_back();
  late[0].reset();
  late[1].reset();
  EXPECT_EQ(judge(late).right, 1U);
  late[2].reset();
  EXPECT_EQ(judge(late).begun, 0U);
  Track lost = there_and_back();
  lost[2 * kTurn].reset();
  EXPECT_EQ(judge(lost).alive, 0U);
  EXPECT_EQ(judge(lost).verdicts.at(7), TripVerdict::kLost);
}

TEST(RoundTrip, JumpsAreCountedOverGapsToo) {
  Track track = there_and_back();
  track[5].reset();
  for (std::size_t k = 6; k < 9; ++k) *track[k] += Vector2d(0, 61);
  EXPECT_EQ(judge(track).jumps, 2U);
}

}  // namespace
}  // namespace perimap
