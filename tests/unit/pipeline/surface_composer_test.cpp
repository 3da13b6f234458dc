#include "core/pipeline/surface_composer.hpp"

#include "tests/unit/pipeline/composer_shards.hpp"

namespace perimap {
namespace {

TEST(SurfaceComposer, BreathingIsPartOfPositionVelocityAndCovariance) {
  ComposerSettings with_breath = settings();
  with_breath.layout.respiratory_harmonics = 1;
  SurfaceComposer composer(with_breath);
  FeatureSnapshot breathing = feature(1, 0.0);
  breathing.x = StateVector::Zero(3 * with_breath.layout.size());
  breathing.x(0) = 10.0;
  breathing.x(1 + 2 * kHarmonics) = 5.0;  // a_1 of x
  const ShardSnapshot snapshot = shard(100, {breathing});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  RespiratoryClock clock;
  clock.state = RespirationState::kLocked;
  clock.corrected = true;
  clock.time = kRelease.deadline - milliseconds(500);
  clock.phase_rad = 0.2;
  clock.rate_rad_per_s = 1.5;
  clock.phase_variance_rad2 = 0.01;
  clock.slope_mm_per_rad = 2.0;
  const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), clock, view);
  const double psi = 0.2 + 1.5 * 0.5;
  ASSERT_EQ(sample.features.size(), 1U);
  EXPECT_EQ(sample.state, SurfaceState::kGood);
  EXPECT_NEAR(sample.features[0].p_WF_mm.x(), 10.0 + 5.0 * std::cos(psi), 1e-9);
  EXPECT_NEAR(sample.features[0].velocity_W_mm_per_s.x(), -5.0 * std::sin(psi) * 1.5, 1e-9);
  EXPECT_NEAR(sample.features[0].covariance_W_mm2(1, 1), 0.04 + 0.2 * 0.2, 1e-9);
}

TEST(SurfaceComposer, WhileTheBreathIsNotKnownNothingIsCalledGood) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  RespiratoryClock searching;
  searching.state = RespirationState::kSearching;
  RespiratoryClock suspected;
  suspected.suspected = true;
  for (RespiratoryClock clock : {searching, suspected}) {
    clock.unknown_displacement_mm = 5.0;
    const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), clock, view);
    EXPECT_EQ(sample.state, SurfaceState::kDegraded);
    EXPECT_EQ(sample.reason, SurfaceReason::kRespirationUnknown);
    ASSERT_EQ(sample.features.size(), 1U);
    EXPECT_EQ(sample.features[0].state, FeatureState::kConverging);
    EXPECT_GT(sample.features[0].covariance_W_mm2(2, 2), 25.0);
  }
}

TEST(SurfaceComposer, NothingIsCalledGoodBeforeTheImagesHaveCorrectedTheBreath) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  RespiratoryClock clock;
  clock.state = RespirationState::kLocked;
  clock.time = kRelease.deadline;
  clock.rate_rad_per_s = 1.5;
  const auto states = [&] {
    const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), clock, view);
    return std::pair(sample.reason, sample.features.at(0).state);
  };
  EXPECT_EQ(states(), std::pair(SurfaceReason::kRespirationUnknown, FeatureState::kConverging));
  clock.corrected = true;
  EXPECT_EQ(states(), std::pair(SurfaceReason::kNone, FeatureState::kConverged));
}

TEST(SurfaceComposer, WidensByWhatTheSetUpMayBeOffBy) {
  SurfaceComposer composer(settings());
  ShardSnapshot snapshot = shard(100, {feature(1, 0.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const auto variance = [&](const Release& release) {
    return composer.compose(release, steady_clock(), {}, view).features.at(0).covariance_W_mm2(1, 1);
  };
  Release missing = kRelease;
  missing.frame_missing = true;
  const double before = variance(kRelease), bound_before = variance(missing);
  snapshot.doubts.setup_widening_mm = 1.5;
  EXPECT_NEAR(variance(kRelease), before + 0.75, 1e-12) << "a third of its square on each axis";
  EXPECT_NEAR(variance(missing), bound_before + 2.25, 1e-12) << "a bound holds in any direction";
}

TEST(SurfaceComposer, EvaluatesPositionAndVelocityAtTheValidTimesPhase) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const CardiacClock clock = steady_clock();
  const SurfaceSample& sample = composer.compose(kRelease, clock, RespiratoryClock{}, view);
  // 200 ms after the R peak of a cycle of 800 ms: a quarter of it, where the cosine is zero and falls fastest.
  ASSERT_EQ(sample.features.size(), 1U);
  EXPECT_NEAR(sample.features[0].p_WF_mm.x(), 10.0, 0.2);
  EXPECT_NEAR(sample.features[0].velocity_W_mm_per_s.x(), -4.0 * sample.cardiac_phase_rate_rad_per_s, 0.2);
  EXPECT_EQ(sample.state, SurfaceState::kGood);
  EXPECT_EQ(sample.valid_time, kRelease.deadline);
}

TEST(SurfaceComposer, SaysWhereTheCameraWasAtTheReleasesOwnCaptureOrThatItIsNotKnown) {
  SurfaceComposer composer(settings());
  ShardSnapshot snapshot = shard(101, {feature(1, 4.0)});
  snapshot.cameras[0] = {101, {true, {Matrix3d::Identity(), Vector3d(1, 2, 3)}}};
  snapshot.cameras[1] = {100, {true, {Matrix3d::Identity(), Vector3d(4, 5, 6)}}};  // of what is released
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const CardiacClock clock = steady_clock();
  const CameraPlace known = composer.compose(kRelease, clock, RespiratoryClock{}, view).camera;
  EXPECT_TRUE(known.known);
  EXPECT_EQ(known.X_WC.t, Vector3d(4, 5, 6));
  Release missing = kRelease;
  missing.frame_missing = true;
  EXPECT_FALSE(composer.compose(missing, clock, RespiratoryClock{}, view).camera.known);
  Release later = kRelease;
  later.frame_sequence = 102;
  EXPECT_FALSE(composer.compose(later, clock, RespiratoryClock{}, view).camera.known);
}

TEST(SurfaceComposer, AddsWhatThePhaseDeviationMakesOfTheMotion) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const CardiacClock clock = steady_clock();
  const SurfaceSample& sample = composer.compose(kRelease, clock, RespiratoryClock{}, view);
  const double deviation_s = clock.at(kRelease.deadline).deviation_s;
  const double v = sample.features[0].velocity_W_mm_per_s.x();
  EXPECT_NEAR(sample.features[0].covariance_W_mm2(0, 0), 0.04 + v * v * deviation_s * deviation_s,
              0.05 * v * v * deviation_s * deviation_s)
      << "v v^T sigma^2, to first order";
  EXPECT_NEAR(sample.features[0].covariance_W_mm2(1, 1), 0.04, 1e-12);
}

TEST(SurfaceComposer, APhaseThatTheImagesContradictDegradesTheSurface) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  CycleCorrection correction;
  correction.beats = steady_clock().beats();
  correction.begin = at_ms(9000);
  correction.length = milliseconds(800);
  correction.contradicted = true;
  const SurfaceSample& sample =
      composer.compose(kRelease, steady_clock().corrected(correction), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kDegraded);
  EXPECT_EQ(sample.reason, SurfaceReason::kPhaseContradicted);
}

TEST(SurfaceComposer, ALargePhaseDeviationIsFeltWhereTheMotionTurns) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  // Valid at the R peak, where the cosine stands still, and a fifth of a cycle uncertain.
  const Release at_peak{100, Instant(milliseconds(9750)), Instant(milliseconds(9800)), false};
  CycleCorrection correction;
  correction.beats = steady_clock().beats();
  correction.begin = at_ms(9000);
  correction.begin_deviation = milliseconds(160);
  correction.length = milliseconds(800);
  const SurfaceSample& sample =
      composer.compose(at_peak, steady_clock().corrected(correction), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kGood);
  EXPECT_NEAR(sample.features[0].velocity_W_mm_per_s.x(), 0.0, 0.5);
  EXPECT_GT(sample.features[0].covariance_W_mm2(0, 0), 5.0);
}

TEST(SurfaceComposer, OrdersFeaturesOfAllShardsById) {
  SurfaceComposer composer(settings());
  const ShardSnapshot a = shard(100, {feature(5, 1.0), feature(2, 1.0)});
  const ShardSnapshot b = shard(100, {feature(3, 1.0)});
  const std::array<const ShardSnapshot*, 2> view = {&a, &b};
  const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view);
  ASSERT_EQ(sample.features.size(), 3U);
  EXPECT_EQ(sample.features[0].id, 2U);
  EXPECT_EQ(sample.features[1].id, 3U);
  EXPECT_EQ(sample.features[2].id, 5U);
}

TEST(SurfaceComposer, NamesTheOldestShardAndSaysThatTheUpdateIsLate) {
  SurfaceComposer composer(settings());
  const ShardSnapshot a = shard(100, {feature(1, 1.0)});
  const ShardSnapshot b = shard(98, {feature(2, 1.0)});
  const std::array<const ShardSnapshot*, 2> view = {&a, &b};
  const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.oldest_shard_frame_sequence, 98U);
  EXPECT_EQ(sample.state, SurfaceState::kDegraded);
  EXPECT_EQ(sample.reason, SurfaceReason::kUpdateLate);
  EXPECT_NEAR(sample.features[1].covariance_W_mm2(1, 1), 0.25, 1e-12) << "the largest deviation over the cycle";
}

TEST(SurfaceComposer, SaysThatTheFrameOrThePoseIsMissing) {
  SurfaceComposer composer(settings());
  ShardSnapshot snapshot = shard(99, {feature(1, 1.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  Release missing = kRelease;
  missing.frame_missing = true;
  EXPECT_EQ(composer.compose(missing, steady_clock(), RespiratoryClock{}, view).reason, SurfaceReason::kFrameMissing);
  snapshot.frame_sequence = 100;
  snapshot.pose_missing = true;
  EXPECT_EQ(composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view).reason, SurfaceReason::kPoseMissing);
}

TEST(SurfaceComposer, SaysThatTheImagesShowNothingOfTheMap) {
  SurfaceComposer composer(settings());
  ShardSnapshot snapshot = shard(100, {feature(1, 1.0), feature(2, 1.0)});
  for (FeatureSnapshot& feature : snapshot.features) feature.in_sight = false;
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& unseen = composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(unseen.state, SurfaceState::kDegraded);
  EXPECT_EQ(unseen.reason, SurfaceReason::kNotSeen);
  snapshot.features[0].in_sight = true;
  EXPECT_EQ(composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view).state, SurfaceState::kGood);
}

TEST(SurfaceComposer, MarksEveryPositionInvalidWhenThePhaseIsUnknownOrLost) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& unknown = composer.compose(kRelease, CardiacClock{}, RespiratoryClock{}, view);
  EXPECT_EQ(unknown.state, SurfaceState::kInvalid);
  EXPECT_EQ(unknown.reason, SurfaceReason::kPhaseUnknown);
  EXPECT_EQ(unknown.features[0].state, FeatureState::kInvalid);
  Release late = kRelease;
  late.deadline = at_ms(30'000);
  const SurfaceSample& lost = composer.compose(late, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(lost.reason, SurfaceReason::kPhaseLost);
  EXPECT_EQ(lost.state, SurfaceState::kInvalid);
  EXPECT_EQ(lost.features[0].state, FeatureState::kInvalid);
  EXPECT_EQ(lost.features[0].reason, FeatureReason::kPhaseLost);
}

TEST(SurfaceComposer, SaysThatNothingIsMappedYet) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kInvalid);
  EXPECT_EQ(sample.reason, SurfaceReason::kNothingMapped);
}

TEST(SurfaceComposer, CountsSamplesWithoutGaps) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  for (std::uint64_t i = 1; i <= 5; ++i) {
    EXPECT_EQ(composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view).sample_sequence, i);
  }
}

TEST(SurfaceComposer, ALeadMovesTheValidTimeAndNotTheRelease) {
  ComposerSettings ahead = settings();
  ahead.lead = milliseconds(100);
  SurfaceComposer composer(ahead);
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const SurfaceSample& sample = composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.valid_time, kRelease.deadline + milliseconds(100));
  EXPECT_NEAR(sample.cardiac_phase_rad, steady_clock().at(sample.valid_time).phase_rad, 1e-12);
}

TEST(SurfaceComposer, AfterAPrematureBeatUntilTheNextOneNothingIsCalledGood) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  CardiacClockTracker tracker({});
  for (int ms = 1000; ms <= 8200; ms += 800) tracker.on_r_peak({at_ms(ms), at_ms(ms + 60), 1.0, milliseconds(1)});
  RPeak premature{at_ms(8700), at_ms(8760), 1.0, milliseconds(1)};
  premature.beat_class = BeatClass::kPremature;
  tracker.on_r_peak(premature);
  const SurfaceSample& sample = composer.compose(kRelease, tracker.clock(), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kDegraded);
  EXPECT_EQ(sample.reason, SurfaceReason::kEctopicBeat);
}

TEST(SurfaceComposer, APhaseThatTheImagesAloneCarryDegradesTheSurface) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  CycleCorrection correction;
  correction.beats = steady_clock().beats();
  correction.begin = at_ms(9010);
  correction.length = milliseconds(800);
  correction.carried = true;
  correction.seen = true;
  const SurfaceSample& sample =
      composer.compose(kRelease, steady_clock().corrected(correction), RespiratoryClock{}, view);
  EXPECT_EQ(sample.state, SurfaceState::kDegraded);
  EXPECT_EQ(sample.reason, SurfaceReason::kPhaseFromImage);
}

// The frames of this run are counted from one again, those of the run before were many.
TEST(SurfaceComposer, AReleaseBetweenThoseThatWereEvaluatedGetsTheCovarianceBetween) {
  SurfaceComposer composer(settings());
  FeatureSnapshot shown = feature(1, 0.0);
  for (std::size_t i = 0; i < kReleasesCovered; ++i) {
    shown.covariances_W_mm2[i] = 0.01 * static_cast<double>(i + 1) * Matrix3d::Identity();
  }
  const ShardSnapshot snapshot = shard(102, {shown});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const auto variance_at = [&](int ms, bool missing = false) {
    Release release = kRelease;
    release.deadline = at_ms(ms);
    release.frame_missing = missing;
    return composer.compose(release, steady_clock(), RespiratoryClock{}, view).features[0].covariance_W_mm2(2, 2);
  };
  EXPECT_NEAR(variance_at(9200), 0.01, 1e-12);
  EXPECT_NEAR(variance_at(9215), 0.015, 1e-12);
  EXPECT_NEAR(variance_at(9260), 0.03, 1e-12);
  EXPECT_NEAR(variance_at(9261), 0.25, 1e-12);
  EXPECT_NEAR(variance_at(9230, true), 0.25, 1e-12) << "no frame: the largest deviation over the cycle";
}

TEST(SurfaceComposer, AnEarlierRunsMapIsALateUpdateHoweverItsFramesWereCounted) {
  for (const ReleaseStream stream : kReleaseStreams) {
    SurfaceComposer composer(settings());
    ShardSnapshot snapshot = shard(5000, {feature(1, 4.0)});
    snapshot.recalled = true;
    snapshot.capture = at_ms(3000);
    const std::array<const ShardSnapshot*, 1> view = {&snapshot};
    Release release = kRelease;
    release.frame_sequence = 3;
    release.stream = stream;
    const SurfaceSample& sample = composer.compose(release, steady_clock(), RespiratoryClock{}, view);
    EXPECT_EQ(sample.reason, SurfaceReason::kUpdateLate);
    EXPECT_TRUE(sample.update_late);
    EXPECT_EQ(sample.features[0].reason, FeatureReason::kNotObserved);
    if (stream == ReleaseStream::kClock) {
      EXPECT_EQ(sample.release.capture, at_ms(3000)) << "its age shows";
      EXPECT_EQ(sample.release.frame_sequence, 0U) << "its number is none of this run";
    }
  }
}

TEST(SurfaceComposer, OneShardWithAnEarlierRunsMapMakesTheWholeLate) {
  const ShardSnapshot mapped = shard(3, {feature(1, 4.0)});
  ShardSnapshot recalled = shard(5000, {feature(2, 4.0)});
  recalled.recalled = true;
  Release release = kRelease;
  release.frame_sequence = 3;
  for (const auto& view :
       {std::array{&mapped, &std::as_const(recalled)}, std::array{&std::as_const(recalled), &mapped}}) {
    SurfaceComposer composer(settings());
    EXPECT_TRUE(composer.compose(release, steady_clock(), RespiratoryClock{}, view).update_late);
  }
}

TEST(SurfaceComposer, ASampleThatIsNotSentLeavesNoGapInTheNumbers) {
  SurfaceComposer composer(settings());
  const ShardSnapshot snapshot = shard(100, {feature(1, 4.0)});
  const std::array<const ShardSnapshot*, 1> view = {&snapshot};
  const auto number = [&] {
    return composer.compose(kRelease, steady_clock(), RespiratoryClock{}, view).sample_sequence;
  };
  EXPECT_EQ(number(), 1U);
  EXPECT_EQ(number(), 2U);
  composer.take_back();
  EXPECT_EQ(number(), 2U);
}

// Stream "clock": what is told by then is frame 100, and a grid's release at 9210 ms.

}  // namespace
}  // namespace perimap
