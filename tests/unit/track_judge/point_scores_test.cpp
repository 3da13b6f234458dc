#include "daemon/evaluation/track_judge/point_scores.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

// A point that is given in the first frame and stays for four more.
Track standing(std::size_t frames = 5) { return Track(frames, Vector2d(10, 10)); }

TEST(PointScores, ArePerfectForWhatIsTheTruth) {
  const PointScores scores = score_points({{1, standing()}}, {{1, standing()}});
  EXPECT_DOUBLE_EQ(scores.delta_average, 1);
  EXPECT_DOUBLE_EQ(scores.average_jaccard, 1);
  EXPECT_DOUBLE_EQ(scores.occlusion_accuracy, 1);
}

TEST(PointScores, AnErrorCountsAtTheDistancesBelowIt) {
  Track off = standing();
  for (auto& px : off) *px += Vector2d(10, 0);
  const PointScores scores = score_points({{1, off}}, {{1, standing()}});
  EXPECT_EQ(scores.delta, (std::array<double, 5>{0, 0, 1, 1, 1}));
  EXPECT_DOUBLE_EQ(scores.delta_average, 0.6);
  EXPECT_DOUBLE_EQ(scores.average_jaccard, 0.6);
}

TEST(PointScores, AHiddenPointThatIsTrackedIsWrongAndAVisibleOneThatIsNotIsMissed) {
  Track truth = standing(), track = standing();
  truth[4].reset();  // of four that count: three visible
  track[1].reset();
  const PointScores scores = score_points({{1, track}}, {{1, truth}});
  EXPECT_DOUBLE_EQ(scores.delta_average, 2.0 / 3);
  EXPECT_DOUBLE_EQ(scores.average_jaccard, 2.0 / 4);
  EXPECT_DOUBLE_EQ(scores.occlusion_accuracy, 2.0 / 4);
}

TEST(PointScores, ATrackThatIsNotThereIsMissed) {
  const PointScores scores = score_points({}, {{1, standing()}});
  EXPECT_DOUBLE_EQ(scores.delta_average, 0);
  EXPECT_DOUBLE_EQ(scores.average_jaccard, 0);
}

}  // namespace
}  // namespace perimap
