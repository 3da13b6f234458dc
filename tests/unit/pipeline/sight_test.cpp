#include "core/pipeline/sight.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Instant kCapture{std::chrono::seconds(10)};

ShardSnapshot shard(std::size_t features, std::size_t seen) {
  ShardSnapshot snapshot;
  snapshot.capture = kCapture;
  snapshot.features.resize(features);
  for (std::size_t i = 0; i < features; ++i) {
    snapshot.features[i].last_observed = kCapture - Sight::kLately - (i < seen ? milliseconds(0) : milliseconds(1));
  }
  return snapshot;
}

bool lost(std::size_t features, std::size_t seen) {
  Sight sight;
  sight.add(shard(features, seen));
  return sight.lost();
}

TEST(Sight, OfALargeMapAsManyMustBeSeenAsCouldContradictThePhase) {
  EXPECT_FALSE(lost(200, Sight::kEnough));
  EXPECT_TRUE(lost(200, Sight::kEnough - 1));
  EXPECT_TRUE(lost(200, 0));
}

TEST(Sight, OfASmallMapHalfMustBeSeen) {
  EXPECT_FALSE(lost(1, 1));
  EXPECT_TRUE(lost(1, 0));
  EXPECT_FALSE(lost(5, 3));
  EXPECT_TRUE(lost(5, 2));
}

TEST(Sight, OfNoMapNothingIsLost) { EXPECT_FALSE(Sight().lost()); }

TEST(Sight, EachShardIsJudgedByItsOwnFrame) {
  Sight sight;
  sight.add(shard(10, 4));
  ShardSnapshot later = shard(10, 4);
  later.capture += std::chrono::seconds(1);
  for (FeatureSnapshot& feature : later.features) feature.last_observed += std::chrono::seconds(1);
  sight.add(later);
  EXPECT_FALSE(sight.lost());
}

}  // namespace
}  // namespace perimap
