// Prints what a bank makes of simulated features, every bit of it. Compiled for groups of different sizes, which must
// print the same (results_do_not_depend_on_the_group_size.sh).
#include <cstdio>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "core/bank/feature_bank.hpp"
#include "core/simd/simd_target.hpp"
#include "simulated_feature.hpp"

namespace perimap {
namespace {

constexpr int kFeatures = 29;  // neither groups of four nor of eight are full
constexpr int kSweeps = 6;
constexpr int kLearntPhases = 3;
const BasisLayout kLayout{5, 1};

struct Features {
  std::vector<FeatureEstimate> estimates;
  std::mt19937 random{7};
  std::normal_distribution<double> normal;

  Features() {
    const int d = kLayout.state_size();
    for (int f = 0; f < kFeatures; ++f) {
      Eigen::MatrixXd A(d, d);
      for (double& a : A.reshaped()) a = 0.1 * normal(random);
      const Eigen::MatrixXd P = 0.25 * (A * A.transpose() + Eigen::MatrixXd::Identity(d, d));
      FeatureEstimate estimate{StateVector::Zero(d), StateMatrix(P)};
      for (double& x : estimate.x) x = 0.1 * normal(random);
      for (int axis = 0; axis < 3; ++axis) estimate.x(axis * kLayout.size()) += 8.0 * normal(random);
      estimates.push_back(estimate);
    }
  }
};

void print(const std::string& what, double value) { std::printf("%s %a\n", what.c_str(), value); }

template <class Real>
void run(SimdTarget target) {
  Features features;
  const std::string name = std::string(simd_target_name(target)) + (std::is_same_v<Real, float> ? " float" : " double");
  FeatureBank<Real> bank({.layout = kLayout, .features = kFeatures, .target = target});
  for (int f = 0; f < kFeatures; ++f) bank.set(f, features.estimates[static_cast<std::size_t>(f)]);
  for (int s = 0; s < kSweeps; ++s) {
    if (s == 2) bank.diffuse(9, 0.5);
    if (s == 3) bank.clear(17);
    SweepPhases<Real> phases;
    std::vector<Pose> poses;
    std::vector<Basis> bases;
    for (int i = 0; i < kLearntPhases; ++i) {
      const double t = 0.4 * s + 0.1 * i;
      poses.push_back(test::camera_pose(t, false, 0.2));
      bases.push_back(basis_at(kLayout, 6.0 * t, 1.5 * t));
      phases.add_learnt(bases.back(), basis_at(kLayout, 6.0 * t + 0.1, 1.5 * t), 6.0, 0.01);
    }
    const int ahead = phases.add_predicted(basis_at(kLayout, 2.4 * s + 1.0, 0.6 * s), basis_at(kLayout, 1.0, 0.0), 6.0);
    std::vector<std::vector<Vector2d>> seen(kLearntPhases, std::vector<Vector2d>(kFeatures));
    for (int i = 0; i < kLearntPhases; ++i) {
      for (int f = 0; f < kFeatures; ++f) {
        const auto index = static_cast<std::size_t>(i);
        Vector2d& z = seen[index][static_cast<std::size_t>(f)];
        const StateVector& x = features.estimates[static_cast<std::size_t>(f)].x;
        (void)test::kPixelModel.predict(poses[index] * position_of(x, bases[index]), z);
        z += Vector2d(features.normal(features.random), features.normal(features.random));
        if (f == 5 && s == 1) z.x() += 400.0;  // the gate refuses it
      }
    }
    for (int g = 0; g < bank.groups(); ++g) {
      bank.sweep(g, phases);
      for (int i = 0; i < kLearntPhases; ++i) {
        LaneObservations<Real> measured;
        for (int lane = 0; lane < kLanes; ++lane) {
          const int f = g * kLanes + lane;
          if (f < kFeatures && (s + i + 2 * f) % 5 != 0) {
            measured.set(lane, seen[static_cast<std::size_t>(i)][static_cast<std::size_t>(f)],
                         0.5 * Matrix2d::Identity());
          }
        }
        LaneOutcomes<Real> outcomes;
        bank.update(g, phases, i, poses[static_cast<std::size_t>(i)], test::kPixelModel, measured, {}, outcomes);
        for (int lane = 0; lane < kLanes; ++lane) {
          if ((outcomes.considered >> lane & 1) == 0) continue;
          print(name + " cost of " + std::to_string(g * kLanes + lane), double(outcomes.map_cost[lane]));
          std::printf("%d %d\n", static_cast<int>(outcomes.status[lane]), outcomes.iterations[lane]);
        }
      }
      LaneMotions<Real> motions;
      bank.motion(g, phases, ahead, motions);
      for (int lane = 0; lane < kLanes; ++lane) {
        if ((motions.valid >> lane & 1) == 0) continue;
        for (int a = 0; a < 3; ++a) print(name + " position", double(motions.position[a][lane]));
        for (int a = 0; a < 3; ++a) print(name + " velocity", double(motions.velocity[a][lane]));
        for (int a = 0; a < 6; ++a) print(name + " covariance", double(motions.covariance[a][lane]));
      }
    }
  }
  for (int f = 0; f < kFeatures; ++f) {
    FeatureEstimate estimate;
    bank.get(f, estimate);
    for (const double x : estimate.x) print(name + " x of " + std::to_string(f), x);
    for (const double p : estimate.P.reshaped()) print(name + " P of " + std::to_string(f), p);
  }
}

}  // namespace
}  // namespace perimap

int main() {
  std::fprintf(stderr, "%d lanes\n", perimap::kLanes);
  for (const perimap::SimdTarget target : perimap::simd_targets()) {
    perimap::run<double>(target);
    perimap::run<float>(target);
  }
  return 0;
}
