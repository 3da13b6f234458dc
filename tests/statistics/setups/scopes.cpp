// Scopes that are turned in their camera head.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/field_stop.hpp"
#include "core/calibration/turned_scope.hpp"
#include "drawn_setup.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "setups.hpp"

namespace perimap::test {
namespace {

// A picture of the field stop with a camera's noise: brighter in its middle, with dark spots, as tissue has.
std::vector<std::uint8_t> field_stop_picture(Draw& draw, const FieldStop& stop, int width, int height) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d px(x, y);
      const double scene =
          120.0 - 2.5e-4 * (px - stop.centre_px).squaredNorm() + 25.0 * std::sin(0.05 * x) * std::sin(0.037 * y);
      const double level = 8.0 + scene * stop.passed(px) + draw.normal(4.0);
      pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
    }
  }
  return pixels;
}

// What lens and hand-eye calibrations leave at each turn, per axis: as the rows above have it.
constexpr double kHandEye_rad = 0.025 * kDegree;
constexpr double kHandEye_mm = 0.09;
constexpr double kPrincipal_px = 0.8;

struct ScopeTrial {
  bool refused = true;
  std::vector<double> turns_deg;  // errors of each turn that was read
  double nees = 99.0;
  double target_mm = 99.0;
  double principal_px = 99.0;
};

// Three calibrated turns, and a fourth that nobody calibrated; each turn is read from a picture.
ScopeTrial scope_trial(std::uint64_t seed) {
  constexpr int kWidth = 1280;
  constexpr int kHeight = 720;
  Draw draw(seed);
  const ScopeSetup setup = drawn_setup(seed, kWidth, kHeight);
  const double first = draw.uniform(-3.1, 3.1);
  const std::vector<double> turns{first, first + 75.0 * kDegree, first + 150.0 * kDegree, draw.uniform(-3.1, 3.1)};
  std::vector<SetupAtRotation> setups;
  ScopeTrial trial;
  double nees = 0.0;
  for (const double turn : turns) {
    const ScopeHeld held{std::remainder(turn, 2.0 * std::numbers::pi), 1.0};
    const FieldStop stop = drawn_field_stop(seed, kWidth, kHeight, held);
    const auto pixels = field_stop_picture(draw, stop, kWidth, kHeight);
    const auto reading = read_field_stop({pixels.data(), kWidth, kHeight, kWidth});
    if (!reading) {
      fmt::print("seed {}: {}\n", seed, reading.error().message);
      return trial;
    }
    const double off = std::remainder(reading->notch_rad - held.notch_rad, 2.0 * std::numbers::pi);
    trial.turns_deg.push_back(std::abs(off) / kDegree);
    nees += std::pow(off / reading->notch_deviation_rad, 2.0) / static_cast<double>(turns.size());
    const ScopeSetup truth = turned_setup(setup, held, stop.centre_px);
    if (setups.size() < 3) {
      SetupAtRotation measured;
      measured.rotation_rad = reading->notch_rad;
      measured.rotation_deviation_rad = reading->notch_deviation_rad;
      measured.X_SC = truth.X_SC * Pose{so3_exp(draw.vector(kHandEye_rad)), draw.vector(kHandEye_mm)};
      measured.covariance_C.diagonal() << Vector3d::Constant(kHandEye_rad * kHandEye_rad),
          Vector3d::Constant(kHandEye_mm * kHandEye_mm);
      measured.principal_px =
          Vector2d(truth.lens.cx + draw.normal(kPrincipal_px), truth.lens.cy + draw.normal(kPrincipal_px));
      measured.principal_deviation_px = Vector2d::Constant(kPrincipal_px);
      measured.focal_px = {truth.lens.fx, truth.lens.fy};
      measured.radius_px = reading->radius_px;
      setups.push_back(measured);
      continue;
    }
    const auto fitted = fit_turned_scope(setups, stop.centre_px);
    if (!fitted) {
      fmt::print("seed {}: {}\n", seed, fitted.error().message);
      return trial;
    }
    const SetupAtRotation told = fitted->at(reading->notch_rad);
    const Vector3d target_C(0.0, 0.0, 90.0);
    trial.target_mm = (told.X_SC * target_C - truth.X_SC * target_C).norm();
    trial.principal_px = (told.principal_px - Vector2d(truth.lens.cx, truth.lens.cy)).norm();
  }
  trial.refused = false;
  trial.nees = nees;
  return trial;
}

}  // namespace

void scopes(std::uint64_t seed, int trials, GoalReport& report) {
  std::vector<double> turns, target, principal;
  MeanOfMeasured nees;
  for (int i = 0; i < trials; ++i) {
    const ScopeTrial trial = scope_trial(seed + static_cast<std::uint64_t>(i));
    turns.insert(turns.end(), trial.turns_deg.begin(), trial.turns_deg.end());
    target.push_back(trial.target_mm), principal.push_back(trial.principal_px);
    if (!trial.refused) nees.add(trial.nees);
  }
  report.at_most("scope's rotation, degrees, 95 %", 0.5, percentile(turns, 0.95));
  report.at_most("scopes refused, %", kMostRefused_percent, nees.refused_percent(trials));
  report.within("scope's rotation, NEES", 0.8, 1.2, nees.mean());
  report.at_most("a target 90 mm ahead at another turn, mm, 95 %", 1.0, percentile(target, 0.95));
  report.at_most("principal point at another turn, px, 95 %", 2.0, percentile(principal, 0.95));
}

}  // namespace perimap::test
