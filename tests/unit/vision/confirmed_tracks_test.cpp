#include "core/following/confirmed_tracks.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace perimap {
namespace {

constexpr std::size_t kDelay = 3;

FollowedFeature feature(std::uint32_t id, FollowState state, bool found = true) {
  FollowedFeature feature;
  feature.id = id;
  feature.state = state;
  feature.found = found;
  return feature;
}

// The rows that frames of one feature give, all in all.
std::vector<TrackRow> rows_of(const std::vector<FollowedFeature>& frames) {
  ConfirmedTracks tracks(kDelay);
  std::vector<TrackRow> rows;
  const auto take = [&](std::span<const TrackRow> released) {
    rows.insert(rows.end(), released.begin(), released.end());
  };
  for (std::size_t k = 0; k < frames.size(); ++k) take(tracks.add(k, {&frames[k], 1}));
  take(tracks.finish());
  return rows;
}

TEST(ConfirmedTracks, LeavesOutACandidateThatIsNeverTracked) {
  EXPECT_TRUE(rows_of(std::vector(6, feature(7, FollowState::kCandidate))).empty());
}

TEST(ConfirmedTracks, GivesTheCandidatesThatAVideoTooShortToTellEndsWith) {
  const std::vector<TrackRow> rows = rows_of(std::vector(kDelay, feature(7, FollowState::kCandidate)));
  ASSERT_EQ(rows.size(), kDelay);
  for (const TrackRow& row : rows) EXPECT_TRUE(row.is_candidate);
  std::vector<FollowedFeature> given_up(2, feature(7, FollowState::kCandidate));
  given_up.push_back(feature(7, FollowState::kEmpty, false));
  EXPECT_TRUE(rows_of(given_up).empty());
}

TEST(ConfirmedTracks, GivesACandidatesRowsOnceItIsTracked) {
  std::vector<FollowedFeature> frames(3, feature(7, FollowState::kCandidate));
  frames.push_back(feature(7, FollowState::kTracked));
  frames.push_back(feature(7, FollowState::kOccluded, false));
  frames.push_back(feature(7, FollowState::kTracked));
  const std::vector<TrackRow> rows = rows_of(frames);
  ASSERT_EQ(rows.size(), 5U);
  const std::uint64_t expected[] = {0, 1, 2, 3, 5};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].frame, expected[i]);
    EXPECT_EQ(rows[i].is_candidate, i < 3);
  }
}

TEST(ConfirmedTracks, LeavesOutWhatTurnsOutToBeAnOverlayWhileItsRowsWait) {
  std::vector<FollowedFeature> frames(2, feature(7, FollowState::kTracked));
  frames.push_back(feature(7, FollowState::kEmpty, false));
  frames.back().is_overlay = true;
  EXPECT_TRUE(rows_of(frames).empty());
}

TEST(ConfirmedTracks, HoldsRowsForTheDelayAndGivesThemInTheOrderOfTheFrames) {
  ConfirmedTracks tracks(kDelay);
  const FollowedFeature both[] = {feature(1, FollowState::kTracked), feature(2, FollowState::kCandidate)};
  for (std::uint64_t frame = 0; frame < 10; ++frame) {
    const auto rows = tracks.add(frame, both);
    ASSERT_EQ(rows.size(), frame < kDelay ? 0U : 1U);
    if (rows.empty()) continue;
    EXPECT_EQ(rows[0].frame, frame - kDelay);
    EXPECT_EQ(rows[0].id, 1U);
  }
  EXPECT_EQ(tracks.finish().size(), kDelay);
  EXPECT_TRUE(tracks.finish().empty());
}

}  // namespace
}  // namespace perimap
