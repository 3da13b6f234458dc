#include "core/estimation/local_displacement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace perimap {
namespace {

// As the pipeline asks: see core/pipeline/patch_watch.cpp.
constexpr double kDoubt_chi2 = 25.0;
constexpr double kDoubtOfOthers_chi2 = 15.0;

// Features 7 mm apart on a plane 90 mm before a camera that looks along z.
class Plane {
 public:
  explicit Plane(unsigned seed) : generator_(seed) {
    for (int x = -4; x <= 4; ++x) {
      for (int y = -3; y <= 3; ++y) places_.emplace_back(7.0 * x, 7.0 * y, 90.0);
    }
    map_errors_.assign(places_.size(), Vector3d::Zero());
  }

  // The map is off by so much, and says so.
  void map(double deviation_mm) {
    S_ = deviation_mm * deviation_mm * Matrix3d::Identity();
    for (Vector3d& error : map_errors_) error = deviation_mm * normal3();
  }
  void press(const Vector3d& place_W_mm, double depth_mm, double radius_mm) {
    dent_W_mm_ = place_W_mm;
    depth_mm_ = depth_mm;
    radius_mm_ = radius_mm;
  }
  void mislead(std::size_t feature, const Vector2d& by_px) {
    misled_ = feature;
    by_px_ = by_px;
  }

  // What five matches of each tell, 0.4 px.
  [[nodiscard]] std::vector<OffFeature> features() {
    std::vector<OffFeature> told;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Vector3d& p = places_[i];
      Matrix23d J;
      J << kFocal_px / p.z(), 0.0, -kFocal_px * p.x() / (p.z() * p.z()), 0.0, kFocal_px / p.z(),
          -kFocal_px * p.y() / (p.z() * p.z());
      // A dent's form is not the one that is asked for.
      const double share2 = (p - dent_W_mm_).squaredNorm() / (radius_mm_ * radius_mm_);
      const double share = share2 < 1.0 ? (1.0 - share2) * (1.0 - share2) : 0.0;
      const Vector3d off_mm = share * Vector3d(0.0, 0.0, depth_mm_) + map_errors_[i];
      OffMap off;
      for (int k = 0; k < 5; ++k) {
        Vector2d r = J * off_mm + kMatch_px * normal3().head<2>();
        if (i == misled_) r += by_px_;
        off.add(r, J, kMatch_px * kMatch_px * Matrix2d::Identity(), 1.0);
      }
      told.push_back({p, beside_map(off, S_)});
    }
    return told;
  }

  // The place and radius at which most speaks for a displacement.
  [[nodiscard]] static LocalDisplacement most(const std::vector<OffFeature>& features) {
    LocalDisplacement found;
    for (const OffFeature& feature : features) {
      for (const double radius_mm : {12.0, 20.0}) {
        const LocalDisplacement at = local_displacement(features, feature.p_W_mm, radius_mm);
        if (at.chi2 > found.chi2) found = at;
      }
    }
    return found;
  }

 private:
  static constexpr double kFocal_px = 250.0;
  static constexpr double kMatch_px = 0.4;

  Vector3d normal3() {
    std::normal_distribution<double> normal;
    const double x = normal(generator_);
    const double y = normal(generator_);
    return {x, y, normal(generator_)};
  }

  std::mt19937 generator_;
  std::vector<Vector3d> places_;
  std::vector<Vector3d> map_errors_;
  Matrix3d S_ = Matrix3d::Zero();
  Vector3d dent_W_mm_ = Vector3d::Zero();
  double depth_mm_ = 0.0;
  double radius_mm_ = 1.0;
  std::size_t misled_ = 1000;
  Vector2d by_px_ = Vector2d::Zero();
};

TEST(LocalDisplacement, OfADentIsToldWithItsDirection) {
  Plane plane(1);
  plane.map(0.3);
  const Vector3d middle(14.0, 7.0, 90.0);
  plane.press(middle, 6.0, 16.0);
  const std::vector<OffFeature> features = plane.features();
  const LocalDisplacement found = Plane::most(features);
  EXPECT_GT(found.chi2, kDoubt_chi2);
  EXPECT_GT(found.chi2_of_others, kDoubtOfOthers_chi2);
  EXPECT_GT(local_displacement(features, middle, 12.0).v_W_mm.z(), 2.0);
  // Not where it is not.
  EXPECT_LT(local_displacement(features, Vector3d(-21.0, -14.0, 90.0), 12.0).chi2, kDoubt_chi2);
}

TEST(LocalDisplacement, OfTheMiddleIsToldByWhatIsAroundIt) {
  Plane plane(2);
  plane.map(0.3);
  // A camera that looks straight at it sees nothing of what goes away from it.
  plane.press(Vector3d(0.0, 0.0, 90.0), 8.0, 24.0);
  EXPECT_GT(Plane::most(plane.features()).chi2, kDoubt_chi2);
}

TEST(LocalDisplacement, IsNoneWhereTheMapIsOffByWhatItSays) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Plane plane(100 + seed);
    plane.map(0.6);
    EXPECT_LT(Plane::most(plane.features()).chi2, kDoubt_chi2) << seed;
  }
}

TEST(LocalDisplacement, OfASingleFeatureIsNotThatOfAPlace) {
  Plane plane(3);
  plane.map(0.3);
  plane.mislead(30, Vector2d(16.0, 6.0));
  const LocalDisplacement found = Plane::most(plane.features());
  EXPECT_GT(found.chi2, kDoubt_chi2);
  EXPECT_LT(found.chi2_of_others, kDoubtOfOthers_chi2);
}

TEST(LocalDisplacement, FadesWithWhatWasTold) {
  OffMap off;
  Matrix23d J = Matrix23d::Zero();
  J(0, 0) = J(1, 1) = 3.0;
  off.add(Vector2d(3.0, 0.0), J, 0.25 * Matrix2d::Identity(), 1.0);
  const double before = off.Lambda(0, 0);
  off.fade(0.5);
  EXPECT_DOUBLE_EQ(off.Lambda(0, 0), 0.5 * before);
  // Nothing that is no number is taken.
  off.add(Vector2d(NAN, 0.0), J, Matrix2d::Identity(), 1.0);
  EXPECT_TRUE(off.eta.allFinite());
}

TEST(LocalDisplacement, OfNothingIsNothing) {
  const LocalDisplacement found = local_displacement({}, Vector3d::Zero(), 12.0);
  EXPECT_EQ(found.features, 0);
  EXPECT_EQ(found.chi2, 0.0);
}

}  // namespace
}  // namespace perimap
