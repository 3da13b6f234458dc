#include "daemon/publishing/wire_surface.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/publishing/model_moment.hpp"
#include "daemon/publishing/wire_model.hpp"
#include "drivers/recording/cdr.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

TEST(WireSurface, CarriesEveryFieldOfTheSample) {
  SurfaceSample sample;
  sample.sample_sequence = 7;
  sample.release = {42, Instant(milliseconds(100)), Instant(milliseconds(150)), false};
  sample.valid_time = Instant(milliseconds(150));
  sample.valid_until = Instant(milliseconds(350));
  sample.state = SurfaceState::kDegraded;
  sample.reason = SurfaceReason::kUpdateLate;
  sample.oldest_shard_frame_sequence = 41;
  sample.cardiac_phase_rad = 1.5;
  sample.cardiac_phase_deviation_rad = 0.1;
  sample.cardiac_phase_rate_rad_per_s = 7.5;
  sample.camera = {true, pose_from_wxyz(Vector3d(7, 8, 9), {0.0, 0.0, 1.0, 0.0}), {{640.0, 641.0}, {315.0, 235.0}}};
  SurfaceFeature feature;
  feature.id = 9;
  feature.state = FeatureState::kConverged;
  feature.reason = FeatureReason::kNotObserved;
  feature.p_WF_mm = Vector3d(1, 2, 3);
  feature.velocity_W_mm_per_s = Vector3d(4, 5, 6);
  feature.covariance_W_mm2 << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  feature.last_observed = Instant(milliseconds(90));
  sample.features = {feature};
  sample.use_within_mm = {5.0, 3.0, 1.5};
  sample.uses = {UseVerdict{SurfaceState::kGood, 31}, {SurfaceState::kDegraded, 30}, {SurfaceState::kInvalid, 4}};

  WireSurface wire({"theatre 3", ReleaseStream::kFrame, "tracker"}, 4);
  const perimap_Surface& out = wire.fill(sample, std::chrono::seconds(1000));
  EXPECT_STREQ(out.source, "theatre 3");
  EXPECT_STREQ(out.stream, "frame");
  EXPECT_STREQ(out.frame_id, "tracker");
  EXPECT_EQ(out.sample_sequence, 7U);
  EXPECT_EQ(out.frame_sequence, 42U);
  EXPECT_EQ(out.capture_time_ns, 100'000'000);
  EXPECT_EQ(out.release_time_ns, 150'000'000);
  EXPECT_EQ(out.valid_time_ns, 150'000'000);
  EXPECT_EQ(out.valid_until_ns, 350'000'000);
  EXPECT_EQ(out.release_utc_ns, 1000'150'000'000);
  EXPECT_EQ(out.state, perimap_SURFACE_DEGRADED);
  EXPECT_EQ(out.reason, perimap_SURFACE_REASON_UPDATE_LATE);
  EXPECT_EQ(out.oldest_shard_frame_sequence, 41U);
  EXPECT_EQ(out.display_state, perimap_SURFACE_GOOD);
  EXPECT_EQ(out.measure_state, perimap_SURFACE_DEGRADED);
  EXPECT_EQ(out.contact_state, perimap_SURFACE_INVALID);
  EXPECT_EQ(out.use_within_mm[2], 1.5);
  EXPECT_EQ(out.use_features[0], 31U);
  EXPECT_EQ(out.cardiac_phase_rad, 1.5);
  EXPECT_EQ(out.cardiac_phase_deviation_rad, 0.1);
  EXPECT_EQ(out.cardiac_phase_rate_rad_per_s, 7.5);
  EXPECT_TRUE(out.camera_pose_known);
  EXPECT_EQ(out.translation_WC_mm[2], 9.0);
  EXPECT_EQ(std::abs(out.rotation_WC_wxyz[2]), 1.0);
  EXPECT_EQ(out.camera_focal_px[1], 641.0);
  EXPECT_EQ(out.camera_principal_point_px[0], 315.0);
  ASSERT_EQ(out.features._length, 1U);
  const perimap_SurfaceFeature& f = out.features._buffer[0];
  EXPECT_EQ(f.id, 9U);
  EXPECT_EQ(f.state, perimap_FEATURE_CONVERGED);
  EXPECT_EQ(f.reason, perimap_FEATURE_REASON_NOT_OBSERVED);
  EXPECT_EQ(f.position_W_mm[2], 3.0);
  EXPECT_EQ(f.velocity_W_mm_per_s[0], 4.0);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(f.covariance_W_mm2[i], i + 1.0);
  EXPECT_EQ(f.last_observed_time_ns, 90'000'000);
}

TEST(WireSurface, CutsNamesThatAreTooLong) {
  WireSurface wire({std::string(200, 'x'), ReleaseStream::kFrame, "tracker"}, 1);
  EXPECT_EQ(std::string(wire.fill(SurfaceSample{}, Duration(0)).source), std::string(63, 'x'));
}

TEST(WireSurface, TakesNoMoreBytesThanItsTrafficIsReckonedWith) {
  constexpr std::size_t kFeatures = 200;
  WireSurface wire({std::string(63, 's'), ReleaseStream::kClock, std::string(63, 'f')}, kFeatures);
  SurfaceSample sample;
  CdrSerializer serializer;
  const auto bytes = [&] { return serializer.serialize(wire.fill(sample, Duration(0))).value().size(); };
  const std::size_t without = bytes();
  EXPECT_LE(without, kSurfaceBytes);
  EXPECT_GT(without, kSurfaceBytes / 2) << "or far less would be refused than has to be";
  sample.features.resize(kFeatures);
  EXPECT_LE(bytes(), kSurfaceBytes + kFeatures * kSurfaceFeatureBytes);
  EXPECT_GT(bytes() - without, kFeatures * (kSurfaceFeatureBytes - 8));
}

TEST(WireModel, TakesNoMoreBytesThanItsTrafficIsReckonedWith) {
  constexpr std::size_t kFeatures = 200;
  WireModel wire({std::string(63, 's'), ReleaseStream::kClock, std::string(63, 'f')});
  CardiacClockTracker beats({});
  for (int ms = 1000; ms <= 9000; ms += 400) {
    const Instant peak{std::chrono::milliseconds(ms)};
    beats.on_r_peak({peak, peak + std::chrono::milliseconds(60), 1.0, std::chrono::milliseconds(1)});
  }
  ShardSnapshot snapshot;
  const ShardSnapshot* const view = &snapshot;
  ModelMoment moment;
  moment.snapshots = {&view, 1};
  moment.clock = beats.clock();
  moment.now = Instant{std::chrono::milliseconds(9100)};
  moment.validity = std::chrono::seconds(10);
  CdrSerializer serializer;
  const auto bytes = [&] { return serializer.serialize(wire.fill(moment)).value().size(); };
  const std::size_t without = bytes();
  EXPECT_LE(without, kModelBytes);
  EXPECT_GT(without, kModelBytes / 8);
  snapshot.features.resize(kFeatures);
  for (FeatureSnapshot& feature : snapshot.features) feature.x = StateVector::Zero(moment.layout.state_size());
  const std::size_t feature =
      kModelFeatureBytes + kModelCoefficientBytes * static_cast<std::size_t>(moment.layout.state_size());
  EXPECT_LE(bytes(), kModelBytes + kFeatures * feature);
  EXPECT_GT(bytes() - without, kFeatures * (feature - 16));
}

TEST(WireModel, AFeatureIsAsUncertainAsItIsHeldToTheBound) {
  WireModel wire({"a", ReleaseStream::kFrame, "tracker"});
  ShardSnapshot snapshot;
  snapshot.features.resize(1);
  snapshot.features[0].x = StateVector::Zero(BasisLayout{}.state_size());
  snapshot.features[0].largest_deviation_mm = 0.6;
  const ShardSnapshot* const view = &snapshot;
  ModelMoment moment;
  moment.snapshots = {&view, 1};
  moment.footing.doubts.setup_widening_mm = 0.8;
  EXPECT_NEAR(wire.fill(moment).features._buffer[0].largest_deviation_mm, 1.0, 1e-12)
      << "all of what the set-up may be off by lies in one direction";
}

TEST(WireSurface, EachStreamHasItsOwnName) {
  PipelineSettings settings;
  settings.clock_period = milliseconds(10);
  std::vector<WireSurface> wires = wire_surfaces({"a", ReleaseStream::kFrame, "tracker"}, settings);
  ASSERT_EQ(wires.size(), 2U);
  EXPECT_STREQ(wires[index_of(ReleaseStream::kFrame)].fill({}, Duration(0)).stream, "frame");
  EXPECT_STREQ(wires[index_of(ReleaseStream::kClock)].fill({}, Duration(0)).stream, "clock");
}

}  // namespace
}  // namespace perimap
