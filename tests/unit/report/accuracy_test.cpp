#include "daemon/evaluation/report/accuracy.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/evaluation/report/accuracy_text.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// One big still triangle at z = 100 mm before the camera at the origin.
GroundTruth still_triangle() {
  HeartMesh mesh;
  mesh.vertex_count = 3;
  mesh.harmonics = 0;
  mesh.coefficients_mm = {-500, -500, 100, 500, -500, 100, 0, 500, 100};
  mesh.triangles = {0, 2, 1};
  HeartMotion motion;
  for (int i = 0; i < 40; ++i) motion.r_peaks.push_back(Instant(milliseconds(800 * i)));
  auto truth = GroundTruth::create(mesh, motion, {{Instant(milliseconds(1000)), Pose{}}});
  EXPECT_TRUE(truth.has_value());
  return std::move(*truth);
}

CameraModel camera() {
  CameraModel c;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 500;
  c.cx = 320;
  c.cy = 240;
  return c;
}

perimap_SurfaceFeature feature(std::uint32_t id, perimap_FeatureState state, double x_mm) {
  perimap_SurfaceFeature f{};
  f.id = id;
  f.state = state;
  f.position_W_mm[0] = x_mm;
  f.position_W_mm[2] = 100.0;
  f.covariance_W_mm2[0] = f.covariance_W_mm2[3] = f.covariance_W_mm2[5] = 1.0;
  return f;
}

void publish(Accuracy& accuracy, double valid_s, std::vector<perimap_SurfaceFeature> features,
             perimap_SurfaceState state = perimap_SurfaceState{}) {
  perimap_Surface sample{};
  sample.state = state;
  sample.valid_time_ns = sample.release_time_ns = static_cast<std::int64_t>(valid_s * 1e9);
  const auto n = static_cast<std::uint32_t>(features.size());
  sample.features = {n, n, features.data(), false};
  accuracy.add(sample);
}

// Feature `id` was first seen at the image centre, so its true place is (0, 0, 100).
void tell_origin(Accuracy& accuracy, std::uint32_t id, double u_px = 320.0) {
  perimap_ModelFeature f{};
  f.id = id;
  f.first_observed_time_ns = 1'000'000'000;
  f.first_observed_px[0] = u_px;
  f.first_observed_px[1] = 240.0;
  perimap_SurfaceModel model{};
  model.features = {1, 1, &f, false};
  accuracy.add(model);
}

constexpr Instant kFirstFrame{Duration(0)};

TEST(Accuracy, MeasuresTheDistanceToThePointThatTheFirstRayMet) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGED, 0.75)});
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.settled.count, 1U);
  EXPECT_NEAR(report.settled.median_mm, 0.75, 1e-9);
  EXPECT_NEAR(report.mean_nees, 0.75 * 0.75 / 3.0, 1e-9);
}

TEST(Accuracy, CountsAFeatureFromItsFirstConvergedSampleOnWhateverItBecomes) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGING, 50.0)});
  publish(accuracy, 17.0, {feature(1, perimap_FEATURE_CONVERGED, 1.0)});
  publish(accuracy, 18.0, {feature(1, perimap_FEATURE_INCONSISTENT, 9.0)});
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.settled.count, 2U);
  EXPECT_NEAR(report.settled.max_mm, 9.0, 1e-9);
  EXPECT_NEAR(report.share_above_3_mm, 0.5, 1e-12);
}

TEST(Accuracy, CountsOnlyWhatConvergedWithinFifteenSecondsAsEarly) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  tell_origin(accuracy, 2);
  publish(accuracy, 14.0, {feature(1, perimap_FEATURE_CONVERGED, 0.0)});
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGED, 0.0), feature(2, perimap_FEATURE_CONVERGED, 0.0)});
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.converged_by_15_s, 1U);
  EXPECT_EQ(report.features_converged, 2U);
}

TEST(Accuracy, SaysWhichConvergedFeaturesHaveNoTruth) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1, 1e6);
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGED, 0.0), feature(2, perimap_FEATURE_CONVERGED, 0.0)});
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.features_without_truth, 2U);
  EXPECT_EQ(report.settled.count, 0U);
}

TEST(Accuracy, CountsApartWhatWasReleasedBeforeThePrematureBeatWasKnown) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  const auto beat = [](double time_s, double detected_s, BeatClass beat_class) {
    RPeak peak;
    peak.time = Instant(from_seconds(time_s));
    peak.detected_at = Instant(from_seconds(detected_s));
    peak.beat_class = beat_class;
    return peak;
  };
  accuracy.set_beats({beat(16.0, 16.1, BeatClass::kNormal), beat(16.5, 16.6, BeatClass::kPremature),
                      beat(17.5, 17.6, BeatClass::kNormal)});
  tell_origin(accuracy, 1);
  for (const double t : {15.9, 16.4, 17.0, 17.1}) {
    publish(accuracy, t, {feature(1, perimap_FEATURE_CONVERGED, t < 17.05 ? 5.0 : 1.0)}, perimap_SURFACE_GOOD);
  }
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.good.premature_beats, 1U);
  EXPECT_EQ(report.good.off_before_known, 1U) << "at 16.4 s";
  EXPECT_EQ(report.good.off, 2U);
  EXPECT_EQ(report.good.count, 4U);
  EXPECT_EQ(report.good.features_off, 1U);
}

// Twice the square root of 3 mm^2 is 3.46 mm.
TEST(Accuracy, CountsWhatMayBeUsedByTheBoundOfEachUse) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  for (const double off_mm : {1.0, 4.5, 6.0}) {
    perimap_SurfaceFeature converged = feature(1, perimap_FEATURE_CONVERGED, off_mm);
    perimap_Surface sample{};
    sample.display_state = sample.measure_state = perimap_SURFACE_GOOD;
    const double within_mm[3] = {5.0, 4.0, 2.0};
    for (int i = 0; i < 3; ++i) sample.use_within_mm[i] = within_mm[i];
    sample.valid_time_ns = sample.release_time_ns = static_cast<std::int64_t>(16e9);
    sample.features = {1, 1, &converged, false};
    accuracy.add(sample);
  }
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_EQ(report.uses[0].count, 3U);
  EXPECT_EQ(report.uses[0].off, 1U);
  EXPECT_EQ(report.uses[1].off, 2U);
  EXPECT_EQ(report.uses[2].count, 0U) << "the surface is not good for it";
  EXPECT_EQ(nlohmann::json::parse(to_json(report).dump())["uses"]["display"]["positions"], 3);
}

TEST(Accuracy, BringsPublishedInstantsToTheRecordingsClock) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  perimap_ModelFeature f{};
  f.id = 1;
  f.first_observed_time_ns = 501'000'000'000;
  f.first_observed_px[0] = 320.0;
  f.first_observed_px[1] = 240.0;
  perimap_SurfaceModel model{};
  model.features = {1, 1, &f, false};
  accuracy.add(model);
  publish(accuracy, 516.0, {feature(1, perimap_FEATURE_CONVERGED, 2.0)});
  const AccuracyReport report = accuracy.report(std::chrono::seconds(-500));
  EXPECT_EQ(report.settled.count, 1U);
  EXPECT_NEAR(report.settled.median_mm, 2.0, 1e-9);
}

TEST(Accuracy, NothingPublishedIsNotAnError) {
  const GroundTruth truth = still_triangle();
  EXPECT_EQ(Accuracy(truth, camera(), kFirstFrame).report(Duration(0)).settled.count, 0U);
}

// Zero would be the best figure of all, and within every limit.
TEST(Accuracy, GivesNoFigureOfNothing) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGING, 50.0)});
  const AccuracyReport report = accuracy.report(Duration(0));
  EXPECT_FALSE(report.settled.median_mm <= 1e9);
  const nlohmann::json json = nlohmann::json::parse(to_json(report).dump());
  for (const char* key : {"rms_mm", "median_mm", "p95_mm", "max_mm"}) EXPECT_TRUE(json["settled_error"][key].is_null());
  for (const char* key : {"settled_mean_nees", "settled_share_above_3_mm"}) EXPECT_TRUE(json[key].is_null()) << key;
  EXPECT_TRUE(json["seconds"][16]["error"]["median_mm"].is_null());
  EXPECT_EQ(json["settled_error"]["count"], 0);
  EXPECT_NE(to_text(report).find("error       none"), std::string::npos);
}

TEST(Accuracy, TellsTheLargestErrorOfNoGoodPositionAsNone) {
  const GroundTruth truth = still_triangle();
  Accuracy accuracy(truth, camera(), kFirstFrame);
  tell_origin(accuracy, 1);
  // publish() leaves the state at zero, which is not good.
  publish(accuracy, 16.0, {feature(1, perimap_FEATURE_CONVERGED, 1.0)});
  const std::string text = to_text(accuracy.report(Duration(0)));
  EXPECT_NE(text.find("good        0 of 0 positions of state good off by more than 3 mm, largest none"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace perimap
