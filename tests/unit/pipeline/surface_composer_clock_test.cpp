#include "core/pipeline/surface_composer.hpp"
#include "tests/unit/pipeline/composer_shards.hpp"

namespace perimap {
namespace {

constexpr Release kTick{100, Instant(milliseconds(9150)), Instant(milliseconds(9210)), false, ReleaseStream::kClock};

// Covariances of 0.01, 0.02, 0.03, 0.04 mm^2 at 9200, 9220, 9240, 9260 ms; 9 mm^2 at the frames' releases.
ShardSnapshot clock_shard(std::uint64_t frame_sequence) {
  FeatureSnapshot shown = feature(1, 0.0);
  shown.covariances_W_mm2.fill(9.0 * Matrix3d::Identity());
  for (std::size_t i = 0; i < kInstantsCovered; ++i) {
    shown.covariances_W_mm2[kReleasesCovered + i] = 0.01 * static_cast<double>(i + 1) * Matrix3d::Identity();
  }
  ShardSnapshot snapshot = shard(frame_sequence, {shown});
  snapshot.capture = at_ms(9150 + 30 * (static_cast<int>(frame_sequence) - 100));
  for (int i = 0; i < static_cast<int>(kInstantsCovered); ++i) {
    snapshot.instants[kReleasesCovered + static_cast<std::size_t>(i)] = at_ms(9200 + 20 * i);
  }
  return snapshot;
}

TEST(SurfaceComposerClock, TakesTheCovarianceBetweenTheInstantsThatWereEvaluated) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = clock_shard(100);
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const auto variance_at = [&](int ms) {
    Release release = kTick;
    release.deadline = at_ms(ms);
    return composer.compose(release, steady_clock(), RespiratoryClock{}, view).features[0].covariance_W_mm2(2, 2);
  };
  EXPECT_NEAR(variance_at(9200), 0.01, 1e-12);
  EXPECT_NEAR(variance_at(9210), 0.015, 1e-12);
  EXPECT_NEAR(variance_at(9245), 0.0325, 1e-12);
  EXPECT_NEAR(variance_at(9260), 0.04, 1e-12);
  EXPECT_NEAR(variance_at(9261), 0.25, 1e-12) << "beyond them the largest deviation over the cycle bounds it";
  EXPECT_NEAR(variance_at(9199), 0.25, 1e-12);
}

TEST(SurfaceComposerClock, BelongsToTheNewestFrameThatItRestsOn) {
  SurfaceComposer composer(settings());
  ShardSnapshot snapshot = clock_shard(101);
  snapshot.camera = {true, {Matrix3d::Identity(), Vector3d(1, 2, 3)}};
  snapshot.cameras[0] = {100, {true, {Matrix3d::Identity(), Vector3d(4, 5, 6)}}};
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& sample = composer.compose(kTick, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kGood);
  EXPECT_EQ(sample.release.frame_sequence, 101U);
  EXPECT_EQ(sample.release.capture, at_ms(9180));
  EXPECT_EQ(sample.release.deadline, kTick.deadline);
  EXPECT_EQ(sample.valid_time, kTick.deadline);
  EXPECT_EQ(sample.camera.X_WC.t, Vector3d(1, 2, 3));
}

TEST(SurfaceComposerClock, WhileOneShardLagsTheWholeBelongsToItsFrame) {
  SurfaceComposer composer(settings());
  const ShardSnapshot ahead = clock_shard(101);
  const ShardSnapshot behind = clock_shard(100);
  const std::array<const ShardSnapshot*, 2> view = {&ahead, &behind};
  const SurfaceSample& sample = composer.compose(kTick, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.release.frame_sequence, 100U);
  EXPECT_EQ(sample.release.capture, at_ms(9150));
  EXPECT_EQ(sample.state, SurfaceState::kGood) << "no newer frame is owed";
}

TEST(SurfaceComposerClock, SaysThatTheFrameThatIsOwedWasNotMappedOrHasNotCome) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = clock_shard(99);
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& late = composer.compose(kTick, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(late.state, SurfaceState::kDegraded);
  EXPECT_EQ(late.reason, SurfaceReason::kUpdateLate);
  EXPECT_EQ(late.release.frame_sequence, 99U);
  EXPECT_EQ(late.release.capture, at_ms(9120)) << "its age shows";
  Release missing = kTick;
  missing.frame_missing = true;
  const SurfaceSample& alone = composer.compose(missing, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(alone.reason, SurfaceReason::kFrameMissing);
  EXPECT_TRUE(alone.release.frame_missing);
  EXPECT_FALSE(alone.update_late);
  EXPECT_EQ(alone.features[0].reason, FeatureReason::kNotObserved);
}

TEST(SurfaceComposerClock, ANewerFrameMakesUpForOneThatIsMissing) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = clock_shard(101);
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  Release missing = kTick;
  missing.frame_missing = true;
  const SurfaceSample& sample = composer.compose(missing, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kGood);
  EXPECT_FALSE(sample.release.frame_missing);
}

TEST(SurfaceComposerClock, IsInvalidWhenThePhaseIsLostHoweverOftenItIsReleased) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = clock_shard(100);
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  Release release = kTick;
  release.deadline = at_ms(30'000);
  const SurfaceSample& sample = composer.compose(release, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kInvalid);
  EXPECT_EQ(sample.features[0].state, FeatureState::kInvalid);
}

}  // namespace
}  // namespace perimap
