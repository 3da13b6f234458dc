#include "core/pipeline/sight.hpp"

#include <gtest/gtest.h>

#include "core/pipeline/feature_stages.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

FeatureSnapshot feature(FeatureState state, bool expected, bool in_sight) {
  FeatureSnapshot snapshot;
  snapshot.state = state;
  snapshot.expected = expected;
  snapshot.in_sight = in_sight;
  return snapshot;
}

void add(Sight& sight, std::size_t count, const FeatureSnapshot& feature) {
  ShardSnapshot shard;
  shard.features.resize(count, feature);
  sight.add(shard);
}

bool lost(std::size_t expected, std::size_t seen) {
  Sight sight;
  add(sight, seen, feature(FeatureState::kConverged, true, true));
  add(sight, expected - seen, feature(FeatureState::kConverged, true, false));
  return sight.lost();
}

TEST(Sight, OfFewFeaturesThatTheImageShouldShowHalfMustBeSeen) {
  EXPECT_FALSE(lost(1, 1));
  EXPECT_TRUE(lost(1, 0));
  EXPECT_FALSE(lost(5, 3));
  EXPECT_TRUE(lost(5, 2));
  EXPECT_FALSE(lost(16, 8));
  EXPECT_TRUE(lost(16, 7));
}

TEST(Sight, OfManyAThirdMustBeSeen) {
  EXPECT_FALSE(lost(20, 8));
  EXPECT_TRUE(lost(20, 7));
  EXPECT_FALSE(lost(150, 50));
  EXPECT_TRUE(lost(150, 49));
}

TEST(Sight, IsLostWhereTheWholeMapIsOutOfView) {
  Sight sight;
  add(sight, 100, feature(FeatureState::kConverged, false, false));
  EXPECT_TRUE(sight.lost());
  // It left just now.
  add(sight, 1, feature(FeatureState::kConverged, false, true));
  EXPECT_FALSE(sight.lost());
}

TEST(Sight, OfACloseUpTheFewFeaturesInViewAreEnough) {
  Sight sight;
  add(sight, 100, feature(FeatureState::kConverged, false, false));
  add(sight, 4, feature(FeatureState::kConverged, true, true));
  EXPECT_FALSE(sight.lost());
}

TEST(Sight, FeaturesThatAreNotConvergedDoNotBringItBack) {
  for (const FeatureState state : {FeatureState::kConverging, FeatureState::kInconsistent}) {
    Sight sight;
    add(sight, 20, feature(FeatureState::kConverged, true, false));
    add(sight, 100, feature(state, true, true));
    EXPECT_TRUE(sight.lost());
  }
}

TEST(Sight, OfNoConvergedMapNothingIsLost) {
  Sight sight;
  EXPECT_FALSE(sight.lost());
  add(sight, 10, feature(FeatureState::kConverging, true, false));
  EXPECT_FALSE(sight.lost());
}

TEST(Sight, AFeatureIsInSightForHalfASecondAfterItAgreedWithTheMap) {
  FeatureSlot slot;
  slot.last_observed = Instant(std::chrono::seconds(100));
  const auto in_sight = [&](Duration later) {
    FeatureSnapshot snapshot;
    describe(slot, slot.last_observed + later, FrameDoubts{}, snapshot);
    return snapshot.in_sight;
  };
  EXPECT_TRUE(in_sight(milliseconds(500)));
  EXPECT_FALSE(in_sight(milliseconds(501)));
  slot.match_agrees = true;
  EXPECT_TRUE(in_sight(std::chrono::seconds(2))) << "however long the frames are apart";
}

}  // namespace
}  // namespace perimap
