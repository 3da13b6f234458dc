// The settings of the estimator, and a fisheye, in the whole pipeline: what a configuration chooses is what runs, and
// it maps the heart.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "daemon/runtime/replay_setup.hpp"
#include "drivers/calibration/calibration_file.hpp"

namespace perimap {
namespace {

struct Case {
  const char* name;
  const char* configuration;  // below "version = 1"
  std::uint32_t harmonics;
  std::size_t mapped;      // at the end, at least
  double median_error_mm;  // over the last seconds, at most
  bool fisheye = false;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

constexpr Duration kJudged = std::chrono::seconds(3);

// The surfaces of the last seconds, and where their features were first seen.
class LastSurfaces final : public Publication {
 public:
  explicit LastSurfaces(const RecordedTruth& truth) : truth_(truth) {}

  void surface(const perimap_Surface& sample) override {
    const Instant valid = from_ns(sample.valid_time_ns);
    std::erase_if(places_, [&](const Place& place) { return place.valid < valid - kJudged; });
    mapped_ = sample.features._length;
    for (std::uint32_t i = 0; i < sample.features._length; ++i) {
      const perimap_SurfaceFeature& feature = sample.features._buffer[i];
      places_.push_back({feature.id, valid, Vector3d(feature.position_W_mm)});
    }
    if (!to_recording_ && rests_on_its_frame(sample.reason)) {
      to_recording_ = truth_.to_recording(sample.frame_sequence, from_ns(sample.capture_time_ns));
    }
  }
  void surface_model(const perimap_SurfaceModel& model) override {
    harmonics_ = model.cardiac_harmonics;
    for (std::uint32_t i = 0; i < model.features._length; ++i) {
      const perimap_ModelFeature& feature = model.features._buffer[i];
      origins_.try_emplace(feature.id, from_ns(feature.first_observed_time_ns), Vector2d(feature.first_observed_px));
    }
  }
  void phase(const perimap_Phase& /*phase*/) override {}
  void status(const perimap_Status& /*status*/) override {}

  [[nodiscard]] std::size_t mapped() const { return mapped_; }
  [[nodiscard]] std::uint32_t harmonics() const { return harmonics_; }

  // Of all features that are published, converged or not.
  [[nodiscard]] double median_error_mm() const {
    if (!to_recording_) throw std::runtime_error("no surface rests on its frame");
    std::map<std::uint32_t, SurfacePoint> points;
    for (const auto& [id, origin] : origins_) {
      const Instant seen = origin.first + *to_recording_;
      const auto X_WC = truth_.truth.camera_pose(seen);
      Vector3d ray_C;
      if (!X_WC || !truth_.camera.unproject(origin.second, ray_C)) continue;
      if (const auto point = truth_.truth.first_hit(*X_WC, ray_C, seen)) points.emplace(id, *point);
    }
    std::vector<double> errors;
    for (const Place& place : places_) {
      const auto point = points.find(place.id);
      if (point == points.end()) continue;
      errors.push_back((place.p_W_mm - truth_.truth.position(point->second, place.valid + *to_recording_)).norm());
    }
    if (errors.empty()) throw std::runtime_error("no feature has a truth");
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
  }

 private:
  struct Place {
    std::uint32_t id = 0;
    Instant valid;
    Vector3d p_W_mm;
  };

  const RecordedTruth& truth_;
  std::vector<Place> places_;
  std::map<std::uint32_t, std::pair<Instant, Vector2d>> origins_;
  std::optional<Duration> to_recording_;
  std::size_t mapped_ = 0;
  std::uint32_t harmonics_ = 0;
};

// The fisheye that is nearest to a narrow lens with some distortion: r(theta) = tan(theta) (1 + k1 tan^2 + k2 tan^4)
// by least squares over its view. What is left is the tangential distortion, below 0.1 px.
CameraModel as_fisheye(const CameraModel& narrow) {
  constexpr int kAngles = 60;
  constexpr double kWidest_rad = 0.5;
  Eigen::Matrix<double, kAngles, 4> A;
  Eigen::Matrix<double, kAngles, 1> r;
  for (int i = 0; i < kAngles; ++i) {
    const double theta = kWidest_rad * (i + 1) / kAngles;
    const double s = theta * theta;
    const double t = std::tan(theta);
    A.row(i) << theta * s, theta * s * s, theta * s * s * s, theta * s * s * s * s;
    r(i) = t * (1.0 + narrow.k1 * t * t + narrow.k2 * t * t * t * t) - theta;
  }
  const Eigen::Vector4d k = A.colPivHouseholderQr().solve(r);
  CameraModel fisheye = narrow;
  fisheye.lens = Lens::kKannalaBrandt;
  fisheye.k1 = k(0);
  fisheye.k2 = k(1);
  fisheye.k3 = k(2);
  fisheye.k4 = k(3);
  fisheye.p1 = fisheye.p2 = 0.0;
  return fisheye;
}

struct Judged {
  std::size_t mapped = 0;
  std::uint32_t harmonics = 0;
  double median_error_mm = 0.0;
};

class EstimatorSettingsReplay : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-settings-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // With the case's configuration over the recording's own.
  Judged replay(const Case& c) {
    const auto truth = load_truth(PERIMAP_TEST_RECORDING, ReadMode::kStrict);
    if (!truth || !*truth) throw std::runtime_error("no ground truth");
    const std::filesystem::path toml = folder_ / "settings.toml";
    std::ofstream(toml) << "version = 1\n" << c.configuration;
    if (!write_calibration(folder_ / "fisheye.yaml", as_fisheye((*truth)->camera))) throw std::runtime_error("no room");
    auto setup = prepare_replay(PERIMAP_TEST_RECORDING, toml, ReadMode::kStrict);
    if (!setup) throw std::runtime_error(setup.error().error.message);
    setup->pipeline.lockstep = true;
    EXPECT_EQ(setup->pipeline.camera.lens == Lens::kKannalaBrandt, c.fisheye);
    LastSurfaces last(**truth);
    Pipeline pipeline(setup->pipeline);
    LockstepRuntime runtime(pipeline, setup->identity, setup->utc_minus_monotonic, last);
    for (auto event = setup->reader.next().value(); event; event = setup->reader.next().value()) {
      runtime.deliver(*event);
    }
    runtime.finish();
    return {last.mapped(), last.harmonics(), last.median_error_mm()};
  }

  std::filesystem::path folder_;
};

constexpr Case kShipped{"Shipped", "", 8, 60, 0.4};

TEST_P(EstimatorSettingsReplay, MapsTheHeart) {
  static const double shipped_error_mm = replay(kShipped).median_error_mm;
  const Case& c = GetParam();
  const Judged judged = replay(c);
  EXPECT_EQ(judged.harmonics, c.harmonics);
  EXPECT_GE(judged.mapped, c.mapped);
  EXPECT_LT(judged.median_error_mm, c.median_error_mm);
  EXPECT_NE(judged.median_error_mm, shipped_error_mm) << "the setting changed nothing";
}

INSTANTIATE_TEST_SUITE_P(
    All, EstimatorSettingsReplay,
    ::testing::Values(
        // A beat is no sine: what one harmonic leaves is the error.
        Case{"OneHarmonic", "[estimation]\nharmonics = 1\n", 1, 20, 2.0},
        Case{"TwelveHarmonics", "[estimation]\nharmonics = 12\n", 12, 60, 0.4},
        Case{"OneGaussNewtonStep", "[estimation]\nupdate = \"gauss-newton\"\niterations = 1\ntolerance = 0.0\n", 8, 60,
             0.4},
        Case{"ManyShortGaussNewtonSteps",
             "[estimation]\nupdate = \"gauss-newton\"\nstep_factor = 0.3\niterations = 30\ntolerance = 0.0\n", 8, 60,
             0.4},
        Case{"Fisheye", "[camera]\ncalibration = \"fisheye.yaml\"\n", 8, 60, 0.4, true}),
    [](const auto& of) { return std::string(of.param.name); });

}  // namespace
}  // namespace perimap
