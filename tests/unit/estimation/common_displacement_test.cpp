#include "core/estimation/common_displacement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>
#include <random>

namespace perimap {
namespace {

constexpr double kFrames_per_s = 15.0;
const Vector3d kPivot_W_mm(5.0, -3.0, 90.0);
// As the pipeline asks: see core/pipeline/organ_watch.cpp.
constexpr double kDoubt_chi2 = 35.0;
constexpr double kDoubt_mm = 1.2;

Vector6d normal6(std::mt19937& generator) {
  std::normal_distribution<double> normal;
  Vector6d v;
  for (int i = 0; i < 6; ++i) v(i) = normal(generator);
  return v;
}

Matrix6d diagonal(double turn_rad, double shift_mm) {
  Vector6d variances;
  variances << Vector3d::Constant(turn_rad * turn_rad), Vector3d::Constant(shift_mm * shift_mm);
  return variances.asDiagonal();
}

Vector6d of_camera(const Vector6d& d, const Pose& X_WC) {
  Vector6d s;
  s << X_WC.R.transpose() * d.head<3>(), (X_WC.t - kPivot_W_mm).cross(d.head<3>()) - d.tail<3>();
  return s;
}

// A session whose camera sways, with a tracker of 1.4 mm and 0.5 degrees RMS and matches that tell a direction to a
// tenth of a millimetre, and a distance to a half.
class Session {
 public:
  explicit Session(unsigned seed, double correlation_s = 0.0, double told_s = 0.0)
      : generator_(seed),
        correlation_s_(correlation_s),
        statistic_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(told_s))) {
    noise_ = tracker_.llt().matrixL() * normal6(generator_);
  }

  // A frame with the surface so displaced.
  void add(const Vector6d& d) {
    ++frames_;
    const double t = static_cast<double>(frames_) / kFrames_per_s;
    const Pose X_WC{so3_exp(0.1 * Vector3d(std::sin(t), std::cos(0.7 * t), 0.5 * std::sin(0.3 * t))),
                    Vector3d(15.0 * std::sin(0.8 * t), 10.0 * std::cos(0.5 * t), 6.0 * std::sin(0.2 * t))};
    const double rho = correlation_s_ > 0.0 ? std::exp(-1.0 / (kFrames_per_s * correlation_s_)) : 0.0;
    const Matrix6d L = tracker_.llt().matrixL();
    noise_ = rho * noise_ + std::sqrt(1.0 - rho * rho) * (L * normal6(generator_));
    const Matrix6d of_matches = diagonal(0.002, 0.15);
    const Matrix6d M = of_matches.llt().matrixL();
    const Vector6d told = of_camera(d, X_WC) + noise_ + M * normal6(generator_);
    // As an estimate with a wide prior has it.
    const Matrix6d searched = diagonal(0.05, 10.0) + tracker_;
    const Matrix6d posterior = (searched.inverse() + of_matches.inverse()).inverse();
    const Vector6d s = posterior * (of_matches.inverse() * told);
    statistic_.add(now(), displacement_evidence(s, posterior, searched, tracker_, X_WC, kPivot_W_mm));
  }

  [[nodiscard]] Instant now() const {
    return Instant{} +
           std::chrono::milliseconds(static_cast<std::int64_t>(1000.0 * static_cast<double>(frames_) / kFrames_per_s));
  }
  [[nodiscard]] MeanDisplacement mean(std::size_t window) const { return statistic_.mean(window, now(), surface_); }
  [[nodiscard]] bool doubted() const {
    DisplacedSurface surface = surface_;
    surface.map_variance_mm2 = 0.04;
    for (std::size_t window = 0; window < CommonDisplacement::kWindows.size(); ++window) {
      const MeanDisplacement told = statistic_.mean(window, now(), surface);
      if (told.told && told.chi2 >= kDoubt_chi2 && told.size_mm >= kDoubt_mm) return true;
    }
    return false;
  }

 private:
  std::mt19937 generator_;
  double correlation_s_;
  Matrix6d tracker_ = diagonal(0.5 / 57.3 / std::sqrt(3.0), 1.4 / std::sqrt(3.0));
  Vector6d noise_;
  CommonDisplacement statistic_;
  DisplacedSurface surface_{.spread_mm = 20.0, .map_variance_mm2 = 0.0};
  std::int64_t frames_ = 0;
};

// Seconds from the beginning of `displaced` (a function of the seconds since) to the doubt; nothing within 30.
template <class Displaced>
std::optional<double> doubted_after(unsigned seed, const Displaced& displaced) {
  Session session(seed);
  for (int i = 0; i < 20 * 15; ++i) session.add(Vector6d::Zero());
  for (int i = 1; i <= 30 * 15; ++i) {
    const double t = i / kFrames_per_s;
    session.add(displaced(t));
    if (session.doubted()) return t;
  }
  return std::nullopt;
}

Vector6d sideways(double mm) {
  Vector6d d = Vector6d::Zero();
  d(3) = mm;
  return d;
}

TEST(CommonDisplacement, EvidenceWithoutNoiseGivesTheDisplacementBack) {
  const Matrix6d tracker = diagonal(0.005, 0.8);
  const Matrix6d searched = diagonal(0.05, 10.0);
  const Matrix6d of_matches = diagonal(0.002, 0.15);
  const Matrix6d posterior = (searched.inverse() + of_matches.inverse()).inverse();
  const Pose X_WC{so3_exp(Vector3d(0.2, -0.1, 0.4)), Vector3d(10.0, 20.0, -5.0)};
  Vector6d d;
  d << 0.01, -0.02, 0.03, 4.0, -2.0, 1.0;
  const Vector6d s = posterior * (of_matches.inverse() * of_camera(d, X_WC));
  const DisplacementEvidence evidence = displacement_evidence(s, posterior, searched, tracker, X_WC, kPivot_W_mm);
  EXPECT_LT((evidence.W.inverse() * evidence.g - d).norm(), 1e-6);
  // It is worth what tracker and matches are worth together.
  Matrix6d T;
  for (int i = 0; i < 6; ++i) T.col(i) = of_camera(Vector6d::Unit(i), X_WC);
  const Matrix6d expected = T.transpose() * (tracker + of_matches).inverse() * T;
  EXPECT_LT((evidence.W - expected).norm(), 1e-6 * expected.norm());
}

TEST(CommonDisplacement, DisplacedPointsAreTurnedAboutThePivotAndMoved) {
  Vector6d d;
  d << 0.0, 0.0, M_PI / 2.0, 1.0, 2.0, 3.0;
  const Pose X = displaced(d, kPivot_W_mm);
  EXPECT_LT((X * kPivot_W_mm - (kPivot_W_mm + Vector3d(1.0, 2.0, 3.0))).norm(), 1e-12);
  EXPECT_LT((X * (kPivot_W_mm + Vector3d::UnitX()) - (kPivot_W_mm + Vector3d(1.0, 3.0, 3.0))).norm(), 1e-12);
}

TEST(CommonDisplacement, OfWhatIsNotDisplacedChiSquaredIsThatOfChance) {
  for (const double correlation_s : {0.0, 1.0}) {
    Session session(7, correlation_s, correlation_s);
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < 15 * 1200; ++i) {
      session.add(Vector6d::Zero());
      if (i < 200 || i % 60 != 0) continue;
      sum += session.mean(2).chi2;
      ++count;
    }
    EXPECT_NEAR(sum / count, 6.0, 1.0) << correlation_s;
  }
}

TEST(CommonDisplacement, AnHourOfATrackersToldNoiseIsNotDoubted) {
  for (const double correlation_s : {0.0, 3.0}) {
    Session session(11, correlation_s, correlation_s);
    int doubted = 0;
    for (int i = 0; i < 15 * 3600; ++i) {
      session.add(Vector6d::Zero());
      doubted += i % 4 == 0 && session.doubted() ? 1 : 0;
    }
    EXPECT_EQ(doubted, 0) << correlation_s;
  }
}

TEST(CommonDisplacement, AStepOfThreeMillimetresIsDoubtedWithinTwoSeconds) {
  int late = 0;
  for (unsigned seed = 100; seed < 140; ++seed) {
    const auto after = doubted_after(seed, [](double) { return sideways(3.0); });
    late += after && *after <= 2.0 ? 0 : 1;
  }
  EXPECT_LE(late, 2);
}

TEST(CommonDisplacement, ADriftOfSixMillimetresInEighteenSecondsIsDoubtedBeforeItIsThreeMillimetres) {
  int late = 0;
  for (unsigned seed = 200; seed < 240; ++seed) {
    const auto after = doubted_after(seed, [](double t) { return sideways(std::min(t, 18.0) / 3.0); });
    late += after && *after <= 9.0 ? 0 : 1;
  }
  EXPECT_LE(late, 2);
}

TEST(CommonDisplacement, OneFrameThatIsFarOffIsNotDoubted) {
  Session session(5);
  for (int i = 0; i < 20 * 15; ++i) session.add(Vector6d::Zero());
  session.add(sideways(40.0));
  EXPECT_FALSE(session.doubted());
  for (int i = 0; i < 30; ++i) {
    session.add(Vector6d::Zero());
    EXPECT_FALSE(session.doubted());
  }
}

}  // namespace
}  // namespace perimap
