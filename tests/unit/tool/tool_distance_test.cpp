#include "core/tool/tool_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "counted_allocations.hpp"
#include "made_organ.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Instant at_ms(int ms) { return Instant{milliseconds(ms)}; }
const Vector3d kTip_O_mm(0.0, 0.0, 100.0);
constexpr std::size_t kProbe = 3;  // as ToolSample::tool

// A beat each 800 ms, the last at 9 s.
CardiacClock beating() {
  CardiacClockTracker tracker({});
  for (int ms = 1000; ms <= 9000; ms += 800) tracker.on_r_peak({at_ms(ms), at_ms(ms + 60), 1.0, milliseconds(1)});
  return tracker.clock();
}

std::shared_ptr<const MadeSurface> made(double deviation_mm, unsigned seed, std::size_t features = 80) {
  std::mt19937_64 random(seed);
  const auto places = test::places_on_disc(features, 40.0, 3.0, random);
  auto surface = PeriodicSurface::fit(test::kLayout, test::evidence_on(places, deviation_mm, random), Vector3d::Zero());
  auto made = std::make_shared<MadeSurface>();
  made->number = 1;
  made->law = beating().law().law;
  made->capture = at_ms(8500);
  made->mesh = mesh_of(*surface, 1000);
  made->surface.emplace(*std::move(surface));
  return made;
}

SurfaceRelease release() {
  SurfaceRelease release;
  release.sample_sequence = 7;
  release.release_time = release.valid_time = at_ms(9100);
  release.valid_until = at_ms(9300);
  release.state = SurfaceState::kGood;
  release.heart = beating();
  return release;
}

ToolSample reading(int ms, const Vector3d& tip) {
  ToolSample sample;
  sample.source_time = at_ms(ms);
  sample.state = ToolState::kOk;
  sample.X_WS.t = tip - kTip_O_mm;
  sample.tool = kProbe;
  return sample;
}

ToolDistances probe(std::optional<TipInTool> tip = TipInTool{kTip_O_mm, Matrix3d::Zero()}) {
  return {{{"instrument/probe", kProbe, tip}}, PoseHistorySettings{}, 1200};
}

// Still at the place since 9 s.
ToolDistances held_at(const Vector3d& tip) {
  ToolDistances distances = probe();
  for (int ms = 9000; ms <= 9090; ms += 10) distances.add(reading(ms, tip));
  return distances;
}

const Vector3d kBefore(2.0, 3.0, 80.0);  // 10 mm before the organ, about

TEST(ToolDistances, TellHowFarTheTipIsFromTheMovedSurface) {
  const auto surface = made(0.05, 1);
  ToolDistances distances = held_at(kBefore);
  const ToolDistance told = distances.at(release(), surface)[0];
  ASSERT_TRUE(told.tip_known);
  MovedSurface moved(1200);
  for (std::size_t h = 0; h < kToolHorizons.size(); ++h) {
    moved.move(surface->mesh, beating().at(release().valid_time + kToolHorizons[h]), {});
    const PlaceOnSurface place =
        moved.nearest(MeshBorder(surface->mesh.triangles, surface->mesh.support.size()), kBefore);
    EXPECT_EQ(told.ahead[h].state, SurfaceState::kGood);
    EXPECT_EQ(told.ahead[h].reason, ToolDistanceReason::kNone);
    EXPECT_NEAR(told.ahead[h].distance_mm, place.distance_mm, 0.05);
    EXPECT_NEAR(told.ahead[h].rate_mm_per_s, -place.normal_W.dot(place.velocity_W_mm_per_s), 3.0);
    EXPECT_GT(told.ahead[h].deviation_mm, std::sqrt(place.variance_mm2));
  }
  EXPECT_FALSE(told.touches);
  // What the hand may do in that time is not known.
  EXPECT_GT(told.ahead[2].deviation_mm, told.ahead[0].deviation_mm);
}

TEST(ToolDistances, TheirDeviationsAreRight) {
  const auto truth = made(0.001, 2, 150);
  MovedSurface moved(1200);
  const SurfaceRelease now = release();
  moved.move(truth->mesh, now.heart.at(now.valid_time), {});
  double nees = 0.0, squares = 0.0;
  int count = 0;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> across(-18.0, 18.0);
  for (unsigned seed = 10; seed < 60; ++seed) {
    std::mt19937_64 random(seed);
    const auto surface = made(0.2, seed, 60);
    PoseHistorySettings tracker;
    tracker.position_deviation_mm = 0.3;
    ToolDistances distances({{"pointer", kProbe, TipInTool{kTip_O_mm, Matrix3d::Zero()}}}, tracker, 1200);
    const Vector3d tip(across(random), across(random), 82.0);
    for (int ms = 8500; ms <= 9090; ms += 10) {
      distances.add(reading(ms, tip + 0.3 * Vector3d(normal(random), normal(random), normal(random))));
    }
    const ToolDistance told = distances.at(now, surface)[0];
    if (told.ahead[0].state != SurfaceState::kGood) continue;
    const double error = told.ahead[0].distance_mm -
                         moved.nearest(MeshBorder(truth->mesh.triangles, truth->mesh.support.size()), tip).distance_mm;
    nees += error * error / (told.ahead[0].deviation_mm * told.ahead[0].deviation_mm);
    squares += error * error;
    ++count;
  }
  ASSERT_GT(count, 40);
  EXPECT_LT(std::sqrt(squares / count), 0.4);
  EXPECT_GT(nees / count, 0.3);
  EXPECT_LT(nees / count, 1.6);
}

TEST(ToolDistances, ATipOnTheSurfaceTouchesAndOneBeforeItDoesNot) {
  const auto surface = made(0.05, 3);
  const SurfaceRelease now = release();
  MovedSurface moved(1200);
  moved.move(surface->mesh, now.heart.at(now.valid_time), {});
  const PlaceOnSurface place =
      moved.nearest(MeshBorder(surface->mesh.triangles, surface->mesh.support.size()), kBefore);
  EXPECT_TRUE(held_at(place.point_W_mm).at(now, surface)[0].touches);
  EXPECT_TRUE(held_at(place.point_W_mm - 2.0 * place.normal_W).at(now, surface)[0].touches);
  EXPECT_FALSE(held_at(place.point_W_mm + 1.0 * place.normal_W).at(now, surface)[0].touches);
}

TEST(ToolDistances, TheCalibrationsCovarianceIsInTheDeviation) {
  const auto surface = made(0.05, 4);
  ToolDistances distances = probe(TipInTool{kTip_O_mm, 4.0 * Matrix3d::Identity()});
  for (int ms = 9000; ms <= 9090; ms += 10) distances.add(reading(ms, kBefore));
  EXPECT_GT(distances.at(release(), surface)[0].ahead[0].deviation_mm, 1.99);
}

TEST(ToolDistances, SayWhyThereIsNone) {
  const auto surface = made(0.05, 5);
  const auto reason_of = [&](ToolDistances distances, const SurfaceRelease& now,
                             const std::shared_ptr<const MadeSurface>& of) {
    const ToolDistance told = distances.at(now, of)[0];
    EXPECT_EQ(told.ahead[0].state, SurfaceState::kInvalid);
    EXPECT_TRUE(std::isnan(told.ahead[0].distance_mm));
    EXPECT_FALSE(told.touches);
    return told.ahead[0].reason;
  };
  ToolDistances uncalibrated = probe(std::nullopt);
  uncalibrated.add(reading(9090, kBefore));
  EXPECT_EQ(reason_of(std::move(uncalibrated), release(), surface), ToolDistanceReason::kNotCalibrated);
  EXPECT_EQ(reason_of(probe(), release(), surface), ToolDistanceReason::kNotSeen);

  ToolDistances silent = probe();
  silent.add(reading(8900, kBefore));
  EXPECT_EQ(reason_of(silent, release(), surface), ToolDistanceReason::kTooOld);
  ToolSample missing = reading(9080, kBefore);
  missing.state = ToolState::kMissing;
  silent.add(missing);
  EXPECT_EQ(reason_of(silent, release(), surface), ToolDistanceReason::kNotSeen);

  EXPECT_EQ(reason_of(held_at(kBefore), release(), nullptr), ToolDistanceReason::kNoSurface);
  auto other_law = std::make_shared<MadeSurface>(*surface);
  other_law->law = surface->law == PhaseLaw::kLinear ? PhaseLaw::kWarped : PhaseLaw::kLinear;
  EXPECT_EQ(reason_of(held_at(kBefore), release(), other_law), ToolDistanceReason::kNoSurface);
  auto old = std::make_shared<MadeSurface>(*surface);
  old->capture = at_ms(4000);
  EXPECT_EQ(reason_of(held_at(kBefore), release(), old), ToolDistanceReason::kNoSurface);
  auto refused = std::make_shared<MadeSurface>();
  refused->law = surface->law;
  refused->capture = surface->capture;
  EXPECT_EQ(reason_of(held_at(kBefore), release(), refused), ToolDistanceReason::kNoSurface);

  SurfaceRelease invalid = release();
  invalid.state = SurfaceState::kInvalid;
  EXPECT_EQ(reason_of(held_at(kBefore), invalid, surface), ToolDistanceReason::kSurface);
  EXPECT_EQ(reason_of(held_at({90.0, 0.0, 80.0}), release(), surface), ToolDistanceReason::kBeyondEdge);
}

TEST(ToolDistances, AToolThatIsSeenHasItsTipWhateverTheSurface) {
  ToolDistances distances = held_at(kBefore);
  const ToolDistance told = distances.at(release(), nullptr)[0];
  ASSERT_TRUE(told.tip_known);
  EXPECT_LT((told.tip.p_WT_mm - kBefore).norm(), 0.1);
}

TEST(ToolDistances, AreAsDegradedAsTheSurface) {
  SurfaceRelease degraded = release();
  degraded.state = SurfaceState::kDegraded;
  degraded.reason = SurfaceReason::kEctopicBeat;
  ToolDistances distances = held_at(kBefore);
  const ToolDistance told = distances.at(degraded, made(0.05, 6))[0];
  EXPECT_EQ(told.ahead[0].state, SurfaceState::kDegraded);
  EXPECT_EQ(told.ahead[0].reason, ToolDistanceReason::kSurface);
  EXPECT_FALSE(std::isnan(told.ahead[0].distance_mm));
}

TEST(ToolDistances, AReadingOfAnotherToolIsPassedOver) {
  ToolDistances distances = probe();
  ToolSample other = reading(9090, kBefore);
  other.tool = kProbe + 1;
  distances.add(other);
  EXPECT_FALSE(distances.at(release(), nullptr)[0].last_seen);
}

TEST(ToolDistances, TakeNoMemoryOnceASurfaceIsKnown) {
  const auto surface = made(0.05, 8);
  ToolDistances distances = held_at(kBefore);
  const SurfaceRelease now = release();
  static_cast<void>(distances.at(now, surface));
  ToolSample sample = reading(9091, kBefore);
  double sum = 0.0;
  const long taken = test::allocations_of([&] {
    for (int i = 0; i < 10; ++i) {
      sample.source_time += milliseconds(1);
      distances.add(sample);
      sum += distances.at(now, surface)[0].ahead[0].distance_mm;
    }
  });
  EXPECT_EQ(taken, 0);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace perimap
