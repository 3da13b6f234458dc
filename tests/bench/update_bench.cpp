// Time of one feature's update, ours and others', in one run. See run.sh.
#include <barrier>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>

#include "core/bank/feature_bank.hpp"
#include "core/estimation/iterated_update.hpp"
#include "dense_baselines.hpp"
#include "interleaved_timing.hpp"
#include "machine_bounds.hpp"
#include "machine_text.hpp"
#include "simulated_feature.hpp"

namespace perimap::bench {
namespace {

constexpr int kIterations = 3;
constexpr int kFrames = 64;
constexpr int kWindow = 600;
constexpr double kLevelTwoShare_bytes = 512.0 * 1024.0;  // of P: half of the second-level cache of today's servers
constexpr int kRounds = 301;

UpdateSettings three_iterations() {
  UpdateSettings settings;
  settings.max_iterations = kIterations;
  settings.tolerance = 0.0;
  settings.gate = 1e9;
  return settings;
}

// What a camera sees of some features, frame by frame, and their estimates before.
struct Scene {
  BasisLayout layout;
  std::vector<Basis> b;
  std::vector<Basis> b_rate;
  std::vector<Pose> X_CW;
  std::vector<std::vector<Vector2d>> z;  // [frame][feature]
  std::vector<FeatureEstimate> estimates;
  Matrix2d R = test::kPixelDeviation * test::kPixelDeviation * Matrix2d::Identity();

  Scene(int harmonics, int features) : layout{.cardiac_harmonics = harmonics} {
    std::mt19937 generator(71);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> place(-20.0, 20.0);
    const Basis deviations = prior_deviations(layout, Prior{.dc_mm = 1.0, .cardiac_mm = 1.0});
    std::vector<StateVector> truths;
    for (int f = 0; f < features; ++f) {
      const Vector3d p_WF(place(generator), place(generator), 0.5 * place(generator));
      FeatureEstimate estimate = prior_estimate(layout, Prior{.dc_mm = 1.0, .cardiac_mm = 1.0}, p_WF);
      for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < layout.size(); ++i) {
          estimate.x(axis * layout.size() + i) += deviations(i) * normal(generator);
        }
      }
      truths.push_back(estimate.x);
      estimates.push_back(estimate);
    }
    for (int k = 0; k < kFrames; ++k) {
      b.push_back(basis_at(layout, 0.25 * k));
      b_rate.push_back(basis_rate(layout, 0.25 * k));
      X_CW.push_back(test::camera_pose(k / 30.0, false, 0.0));
      std::vector<Vector2d> seen;
      for (const StateVector& truth : truths) {
        Vector2d px = Vector2d::Zero();
        (void)test::kPixelModel.predict(X_CW.back() * position_of(truth, b.back()), px);
        seen.push_back(px + test::kPixelDeviation * Vector2d(normal(generator), normal(generator)));
      }
      z.push_back(seen);
    }
  }
  [[nodiscard]] Observation observation(int frame, int feature) const {
    const auto k = static_cast<std::size_t>(frame % kFrames);
    return {z[k][static_cast<std::size_t>(feature)], R, b[k], X_CW[k]};
  }
};

// A bank that is fed the scene frame by frame.
template <class Real>
class Fed {
 public:
  Fed(const Scene& scene, int learnt, int predicted)
      : bank_({.layout = scene.layout,
               .features = static_cast<int>(scene.estimates.size()),
               .target = best_simd_target()}),
        X_CW_(scene.X_CW),
        predicted_(predicted) {
    for (int f = 0; f < bank_.features(); ++f) bank_.set(f, scene.estimates[static_cast<std::size_t>(f)]);
    for (int k = 0; k < kFrames; ++k) {
      SweepPhases<Real> phases;
      const auto of = [&](int frame) { return static_cast<std::size_t>(frame % kFrames); };
      for (int i = 0; i < learnt; ++i) phases.add_learnt(scene.b[of(k + 5 * i)], scene.b_rate[of(k + 5 * i)], 7.0, 0.0);
      for (int i = 0; i < predicted; ++i) {
        phases.add_predicted(scene.b[of(k + 7 * i)], scene.b_rate[of(k + 7 * i)], 7.0, 0.0);
      }
      phases_.push_back(phases);
      std::vector<LaneObservations<Real>> groups(static_cast<std::size_t>(bank_.groups()));
      for (int f = 0; f < bank_.features(); ++f) {
        const Observation observation = scene.observation(k, f);
        groups[static_cast<std::size_t>(f / kLanes)].set(f % kLanes, observation.z, observation.R);
      }
      measured_.push_back(std::move(groups));
    }
  }

  void sweep_group(int group, int frame) { bank_.sweep(group, phases_[static_cast<std::size_t>(frame % kFrames)]); }
  void learn_group(int group, int frame) {
    const auto k = static_cast<std::size_t>(frame % kFrames);
    bank_.sweep(group, phases_[k]);
    LaneMotions<Real> motions;
    for (int i = 0; i < predicted_; ++i) {
      bank_.motion(group, phases_[k], phases_[k].learnt() + i, motions);
      sum_ += double(motions.position[0][0]);
    }
    if (phases_[k].learnt() == 0) return;
    LaneOutcomes<Real> outcomes;
    bank_.update(group, phases_[k], 0, X_CW_[k], test::kPixelModel, measured_[k][static_cast<std::size_t>(group)],
                 settings, outcomes);
    refused += kLanes - __builtin_popcount(outcomes.accepted);
  }
  void learn_frame() {
    for (int g = 0; g < bank_.groups(); ++g) learn_group(g, frame_);
    ++frame_;
  }
  void pass_frame() {
    LaneMotions<Real> motions;
    for (int g = 0; g < bank_.groups(); ++g) {
      bank_.motion_at(g, phases_[static_cast<std::size_t>(frame_ % kFrames)][0], motions);
      sum_ += double(motions.position[0][0]);
    }
    ++frame_;
  }
  [[nodiscard]] int features() const { return bank_.features(); }
  [[nodiscard]] int groups() const { return bank_.groups(); }

  UpdateSettings settings = three_iterations();
  long refused = 0;

 private:
  FeatureBank<Real> bank_;
  std::vector<SweepPhases<Real>> phases_;
  std::vector<std::vector<LaneObservations<Real>>> measured_;
  std::vector<Pose> X_CW_;
  int predicted_;
  int frame_ = 0;
  double sum_ = 0.0;  // keeps what is predicted from being optimised away
};

double covariance_bytes(const BasisLayout& layout) {
  const double d = layout.state_size();
  return d * (d + 1.0) / 2.0 * sizeof(double);
}

void print_rows(const std::vector<Candidate>& candidates, double memory_ns, double arithmetic_ns) {
  const double paper = candidates.front().median();
  for (const Candidate& candidate : candidates) {
    std::printf("  %-58s %10.0f %10.0f %10.0f %9.1f", candidate.name.c_str(), candidate.median(),
                candidate.quantile(0.99), candidate.quantile(1.0), paper / candidate.median());
    if (candidate.name.find("double") != std::string::npos) {
      std::printf(" %7.0f %% %7.0f %%", 100.0 * memory_ns / candidate.median(),
                  100.0 * arithmetic_ns / candidate.median());
    }
    std::printf("\n");
  }
}

void bench_updates(int harmonics) {
  const BasisLayout layout{.cardiac_harmonics = harmonics};
  const int groups = std::max(1, static_cast<int>(kLevelTwoShare_bytes / (kLanes * covariance_bytes(layout))));
  const Scene scene(harmonics, groups * kLanes);
  const auto features = static_cast<double>(groups * kLanes);
  std::vector<Candidate> candidates;
  const UpdateSettings settings = three_iterations();
  int frame = 0;

  FeatureEstimate paper = scene.estimates[0];
  candidates.emplace_back("paper's formula, dense, Cholesky, 3 iterations", 1.0,
                          [&] { paper_update(paper, scene.observation(frame++, 0), test::kPixelModel, kIterations); });
  FeatureEstimate kalman = scene.estimates[0];
  candidates.emplace_back("Kalman form, dense, rank 2, 3 iterations", 4.0, [&] {
    for (int i = 0; i < 4; ++i) kalman_update(kalman, scene.observation(frame++, 0), test::kPixelModel, kIterations);
  });
  FeatureEstimate scalar = scene.estimates[0];
  candidates.emplace_back("core/estimation/iterated_update, 3 iterations", 16.0, [&] {
    for (int i = 0; i < 16; ++i) {
      (void)iterated_update(scalar, scene.observation(frame++, 0), test::kPixelModel, settings);
    }
  });
#ifdef PERIMAP_BENCH_CERES
  std::vector<Observation> window;
  for (int i = 0; i < kWindow; ++i) window.push_back(scene.observation(i, 0));
  StateVector x = scene.estimates[0].x;
  candidates.emplace_back("Ceres, window of 600 observations solved anew", 1.0, [&] {
    x(0) += 0.1;
    (void)window_solution(x, scene.estimates[0], window, test::kPixelModel);
  });
#endif
  Fed<double> one(scene, 1, 0);
  Fed<double> one_settled(scene, 1, 0);
  one_settled.settings = UpdateSettings{};
  one_settled.settings.gate = 1e9;
  Fed<double> sweep_only(scene, 1, 0);
  Fed<double> learn_and_predict(scene, 1, 2);
  Fed<double> three(scene, 3, 0);
  Fed<float> one_single(scene, 1, 0);
  Fed<float> learn_and_predict_single(scene, 1, 2);
  Fed<double> pass(scene, 1, 0);
  int swept = 0;
  candidates.emplace_back("bank, double, 1 phase, 3 iterations", features, [&] { one.learn_frame(); });
  candidates.emplace_back("bank, double, 1 phase, until converged", features, [&] { one_settled.learn_frame(); });
  candidates.emplace_back("bank, double, 1 learnt + 2 predicted phases, 3 it.", features,
                          [&] { learn_and_predict.learn_frame(); });
  candidates.emplace_back("bank, double, M of 3 phases, 1 update, 3 it.", features, [&] { three.learn_frame(); });
  candidates.emplace_back("bank, double, sweep alone, nothing pending, 1 phase", features, [&] {
    for (int g = 0; g < sweep_only.groups(); ++g) sweep_only.sweep_group(g, swept);
    ++swept;
  });
  candidates.emplace_back("bank, double, motion by a reading pass", features, [&] { pass.pass_frame(); });
  candidates.emplace_back("bank, float, 1 phase, 3 iterations", features, [&] { one_single.learn_frame(); });
  candidates.emplace_back("bank, float, 1 learnt + 2 predicted phases, 3 it.", features,
                          [&] { learn_and_predict_single.learn_frame(); });
  const auto count = static_cast<std::size_t>(features * covariance_bytes(layout) / sizeof(double)) / 64 * 64;
  const std::unique_ptr<double[], decltype(&std::free)> memory(
      static_cast<double*>(std::aligned_alloc(64, count * sizeof(double))), &std::free);
  std::fill_n(memory.get(), count, 1.0);
  candidates.emplace_back("bound: P read and written once (double)", features,
                          [&] { memory_pass(memory.get(), count); });

  double sum = 0.0;
  candidates.emplace_back("bound: 4 multiply-adds an element of P (double)", features,
                          [&] { sum += arithmetic_pass(count); });

  time_interleaved(candidates, kRounds);
  if (!std::isfinite(sum)) std::abort();
  std::printf("\nH = %d, d = %d: %d features in the bank, P %.0f KiB\n", harmonics, layout.state_size(),
              groups * kLanes, features * covariance_bytes(layout) / 1024.0);
  std::printf("  %-58s %10s %10s %10s %9s %9s %9s\n", "ns per feature update", "median", "p99", "max", "x paper",
              "of memory", "of arith.");
  print_rows(candidates, candidates[candidates.size() - 2].median(), candidates.back().median());
  if (one.refused + one_single.refused > 0) {
    std::printf("  refused updates: double %ld, float %ld\n", one.refused, one_single.refused);
  }
}

template <class Real>
void bench_frame(const char* name, int features) {
  const Scene scene(5, features);
  Fed<Real> bank(scene, 1, 2);
  for (int i = 0; i < 4; ++i) bank.learn_frame();
  // One thread and two in turn, over the same groups.
  constexpr int kTimed = 41;
  int frame = 0;
  bool more = true;
  std::barrier<> go(2);
  std::barrier<> done(2);
  std::thread helper([&] {
    for (;;) {
      go.arrive_and_wait();
      if (!more) return;
      for (int g = bank.groups() / 2; g < bank.groups(); ++g) bank.learn_group(g, frame);
      done.arrive_and_wait();
    }
  });
  std::vector<Candidate> candidates;
  candidates.emplace_back("one thread", 1.0, [&] {
    for (int g = 0; g < bank.groups(); ++g) bank.learn_group(g, frame);
    ++frame;
  });
  candidates.emplace_back("two threads", 1.0, [&] {
    go.arrive_and_wait();
    for (int g = 0; g < bank.groups() / 2; ++g) bank.learn_group(g, frame);
    done.arrive_and_wait();
    ++frame;
  });
  time_interleaved(candidates, kTimed);
  more = false;
  go.arrive_and_wait();
  helper.join();
  for (const Candidate& candidate : candidates) {
    std::printf("  %-7s %6d features, %-12s ms: median %7.3f  p99 %7.3f  max %7.3f  least %7.3f\n", name,
                bank.features(), candidate.name.c_str(), 1e-6 * candidate.median(), 1e-6 * candidate.quantile(0.99),
                1e-6 * candidate.quantile(1.0), 1e-6 * candidate.quantile(0.0));
  }
  std::printf("  %-7s speed-up of two threads: %.2f by medians, %.2f by the least\n", name,
              candidates[0].median() / candidates[1].median(),
              candidates[0].quantile(0.0) / candidates[1].quantile(0.0));
}

}  // namespace
}  // namespace perimap::bench

int main() {
  using namespace perimap::bench;
  print_machine(PERIMAP_REVISION);
#ifndef PERIMAP_BENCH_CERES
  std::printf("Ceres was not found at configure time (libceres-dev): its row is left out.\n");
#endif
  for (const int harmonics : {3, 5, 8, 10}) bench_updates(harmonics);
  std::printf("\nOne frame at H = 5: 1 learnt + 2 predicted phases, one update a feature; 60 fps leave 16.7 ms\n");
  bench_frame<double>("double", 10'000);
  bench_frame<float>("float", 10'000);
  bench_frame<double>("double", 112);
  return 0;
}
