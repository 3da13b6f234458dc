// Time of one feature's update, ours and others', in one run. See run.sh.
#include <algorithm>
#include <barrier>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>

#include "core/bank/feature_bank.hpp"
#include "core/estimation/iterated_update.hpp"
#include "core/pipeline/feature_group.hpp"
#include "dense_baselines.hpp"
#include "interleaved_timing.hpp"
#include "machine_bounds.hpp"
#include "machine_text.hpp"
#include "native_baselines.hpp"
#include "simulated_feature.hpp"

namespace perimap::bench {
namespace {

constexpr int kIterations = 3;
constexpr int kFrames = 64;
constexpr int kWindow = 600;
constexpr double kLevelTwoShare_bytes = 512.0 * 1024.0;  // of P: half of the second-level cache of today's servers
constexpr int kRounds = 301;
constexpr const char* kPaper = "paper's formula, dense, Cholesky, -O2, SSE2";
constexpr const char* kPaperNative = "paper's formula, dense, Cholesky, -O3 -march=native";

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
  // The bank learns at `learnt` phases a sweep what is seen at `updates` of them.
  Fed(const Scene& scene, int learnt, int predicted, int updates = 1)
      : bank_({.layout = scene.layout,
               .features = static_cast<int>(scene.estimates.size()),
               .target = best_simd_target()}),
        X_CW_(scene.X_CW),
        updates_(std::min(learnt, updates)),
        predicted_(predicted) {
    for (int f = 0; f < bank_.features(); ++f) bank_.set(f, scene.estimates[static_cast<std::size_t>(f)]);
    const auto of = [](int frame) { return static_cast<std::size_t>(frame % kFrames); };
    for (int k = 0; k < kFrames; ++k) {
      SweepPhases<Real> phases;
      for (int i = 0; i < learnt; ++i) {
        const std::size_t held = of(k + kHeldFrames * i);
        phases.add_learnt(scene.b[held], scene.b_rate[held], 7.0, 0.0);
      }
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
    for (int i = 0; i < predicted_; ++i) read_motion(group, phases_[k], phases_[k].learnt() + i);
    for (int i = 0; i < updates_; ++i) learn_phase(group, frame, i);
  }
  // All that the daemon asks of the bank for one group in a frame in which the matches of the last cycle drain: see
  // FeatureGroup. One capture and kReleases releases are predicted.
  void drain_group(int group, int frame) {
    const SweepPhases<Real>& phases = phases_[static_cast<std::size_t>(frame % kFrames)];
    const int capture = phases.learnt();
    bank_.sweep(group, phases);
    read_motion(group, phases, capture);
    LaneMotions<Real> motions;
    // A deviation of the phase earlier and later; for the frame's common pose, also with breathing.
    for (int i = 1; i <= 4; ++i) {
      bank_.motion_near(group, phases, capture, phases_[static_cast<std::size_t>((frame + i) % kFrames)][0], motions);
      sum_ += double(motions.position[0][0]);
    }
    for (int i = 1; i < predicted_; ++i) read_motion(group, phases, capture + i);
    StateVector x;
    for (int lane = 0; lane < kLanes; ++lane) {
      bank_.get(group * kLanes + lane, x);
      sum_ += x(0);
    }
    for (int i = 0; i < updates_; ++i) {
      read_motion(group, phases, i);
      learn_phase(group, frame, i);
    }
  }
  // The two halves of learn_group().
  void sweep_frame() {
    for (int g = 0; g < bank_.groups(); ++g) sweep_group(g, frame_);
  }
  void update_frame() {
    for (int g = 0; g < bank_.groups(); ++g) learn_phase(g, frame_, 0);
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
  static constexpr int kHeldFrames = 5;  // between the frames that one sweep learns from

  void read_motion(int group, const SweepPhases<Real>& phases, int k) {
    LaneMotions<Real> motions;
    bank_.motion(group, phases, k, motions);
    sum_ += double(motions.position[0][0]);
  }
  void learn_phase(int group, int frame, int i) {
    const auto held = static_cast<std::size_t>((frame % kFrames + kHeldFrames * i) % kFrames);
    LaneOutcomes<Real> outcomes;
    bank_.update(group, phases_[static_cast<std::size_t>(frame % kFrames)], i, X_CW_[held], test::kPixelModel,
                 measured_[held][static_cast<std::size_t>(group)], settings, outcomes);
    refused += kLanes - __builtin_popcount(outcomes.accepted);
  }

  FeatureBank<Real> bank_;
  std::vector<SweepPhases<Real>> phases_;
  std::vector<std::vector<LaneObservations<Real>>> measured_;
  std::vector<Pose> X_CW_;
  int updates_;
  int predicted_;
  int frame_ = 0;
  double sum_ = 0.0;  // keeps what is predicted from being optimised away
};

double covariance_bytes(const BasisLayout& layout) {
  const double d = layout.state_size();
  return d * (d + 1.0) / 2.0 * sizeof(double);
}

void print_rows(const std::vector<Candidate>& candidates, double memory_ns, double arithmetic_ns) {
  const auto median_of = [&](const char* name) {
    const auto found = std::find_if(candidates.begin(), candidates.end(),
                                    [&](const Candidate& candidate) { return candidate.name.rfind(name, 0) == 0; });
    return found == candidates.end() ? std::nan("") : found->cpu_median();
  };
  const double paper = median_of(kPaper);
  const double native = median_of(kPaperNative);
  for (const Candidate& candidate : candidates) {
    const double median = candidate.cpu_median();
    std::printf("  %-58s %10.1f %10.1f %10.1f %9.1f %9.1f", candidate.name.c_str(), median,
                candidate.cpu_quantile(0.99), candidate.median(), paper / median, native / median);
    if (candidate.name.find("double") != std::string::npos) {
      std::printf(" %7.0f %% %7.0f %%", 100.0 * memory_ns / median, 100.0 * arithmetic_ns / median);
    }
    std::printf("\n");
  }
}

// Long: a list of what is timed side by side, each with what it works on, which must outlive the timing.
void bench_updates(int harmonics) {
  const BasisLayout layout{.cardiac_harmonics = harmonics};
  const int groups = std::max(1, static_cast<int>(kLevelTwoShare_bytes / (kLanes * covariance_bytes(layout))));
  const Scene scene(harmonics, groups * kLanes);
  const auto features = static_cast<double>(groups * kLanes);
  std::vector<Candidate> candidates;
  const UpdateSettings settings = three_iterations();
  int frame = 0;

  FeatureEstimate paper = scene.estimates[0];
  candidates.emplace_back(kPaper, 1.0,
                          [&] { paper_update(paper, scene.observation(frame++, 0), test::kPixelModel, kIterations); });
  FeatureEstimate kalman = scene.estimates[0];
  candidates.emplace_back("Kalman form, dense, rank 2, -O2, SSE2", 4.0, [&] {
    for (int i = 0; i < 4; ++i) kalman_update(kalman, scene.observation(frame++, 0), test::kPixelModel, kIterations);
  });
  const auto native = [&] {
    const CameraModel& camera = test::kPixelModel.camera;
    const FeatureEstimate& start = scene.estimates[0];
    return std::make_unique<NativeFeature>(layout.size(), start.x.data(), start.P.data(), camera.fx, camera.cx,
                                           camera.cy);
  };
  const auto plain = [](const Observation& o) {
    return PlainObservation{o.z.data(), o.R.data(), o.b.data(), o.X_CW.R.data(), o.X_CW.t.data()};
  };
  const std::unique_ptr<NativeFeature> native_paper = native();
  const std::unique_ptr<NativeFeature> native_kalman = native();
  candidates.emplace_back(kPaperNative, 1.0, [&] {
    const Observation o = scene.observation(frame++, 0);
    native_paper->paper_update(plain(o), kIterations);
  });
  candidates.emplace_back("Kalman form, dense, rank 2, -O3 -march=native", 4.0, [&] {
    for (int i = 0; i < 4; ++i) {
      const Observation o = scene.observation(frame++, 0);
      native_kalman->kalman_update(plain(o), kIterations);
    }
  });
  // The same numbers by either build, or the comparison is void.
  {
    FeatureEstimate plain_result = scene.estimates[0];
    const std::unique_ptr<NativeFeature> native_result = native();
    const Observation o = scene.observation(0, 0);
    paper_update(plain_result, o, test::kPixelModel, kIterations);
    native_result->paper_update(plain(o), kIterations);
    const Eigen::Map<const Eigen::VectorXd> x(native_result->x(), plain_result.x.size());
    if (!((plain_result.x - x).norm() < 1e-9 * x.norm())) std::abort();
  }
  FeatureEstimate scalar = scene.estimates[0];
  candidates.emplace_back("core/estimation/iterated_update, -O2, SSE2", 16.0, [&] {
    for (int i = 0; i < 16; ++i) {
      (void)iterated_update(scalar, scene.observation(frame++, 0), test::kPixelModel, settings);
    }
  });
  std::vector<Observation> window;
  for (int i = 0; i < kWindow; ++i) window.push_back(scene.observation(i, 0));
  StateVector x = scene.estimates[0].x;
  candidates.emplace_back("Ceres, window of 600 observations solved anew, -O2", 1.0, [&] {
    x(0) += 0.1;
    (void)window_solution(x, scene.estimates[0], window, test::kPixelModel);
  });
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
  Fed<double> swept_alone(scene, 1, 0);
  candidates.emplace_back("part: sweep, one update pending, 1 phase (double)", features,
                          [&] { swept_alone.sweep_frame(); });
  candidates.back().prepare = [&] { swept_alone.update_frame(); };
  Fed<double> updated_alone(scene, 1, 0);
  Fed<double> updated_once(scene, 1, 0);
  updated_once.settings.max_iterations = 1;
  candidates.emplace_back("part: update, 1 iteration (double)", features, [&] { updated_once.update_frame(); });
  candidates.back().prepare = [&] { updated_once.sweep_frame(); };
  candidates.emplace_back("part: update, 3 iterations (double)", features, [&] { updated_alone.update_frame(); });
  candidates.back().prepare = [&] { updated_alone.sweep_frame(); };
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
  std::printf("  %-58s %10s %10s %10s %9s %9s %9s %9s\n", "ns of a processor per feature update", "median", "p99",
              "wall med.", "x paper", "x native", "of memory", "of arith.");
  print_rows(candidates, candidates[candidates.size() - 2].cpu_median(), candidates.back().cpu_median());
  if (one.refused + one_single.refused > 0) {
    std::printf("  refused updates: double %ld, float %ld\n", one.refused, one_single.refused);
  }
}

// One frame of all groups of a bank by one thread and by two in turn, over the same groups.
template <class Real, class Work>
void bench_frame(const char* name, Fed<Real>& bank, Work work) {
  constexpr int kTimed = 61;
  int frame = 0;
  const auto part = [&](int half) {
    for (int g = bank.groups() * half / 2; g < bank.groups() * (half + 1) / 2; ++g) work(bank, g, frame);
  };
  for (; frame < 4; ++frame) {
    part(0);
    part(1);
  }
  bool more = true;
  std::barrier<> go(2);
  std::barrier<> done(2);
  double helper_cpu_s = 0.0;
  std::thread helper([&] {
    for (;;) {
      go.arrive_and_wait();
      if (!more) return;
      const double start = thread_seconds();
      part(1);
      helper_cpu_s = thread_seconds() - start;
      done.arrive_and_wait();
    }
  });
  std::vector<double> longer_part_ms;
  std::vector<double> sum_of_parts_ms;
  std::vector<Candidate> candidates;
  candidates.emplace_back("one thread", 1.0, [&] {
    part(0);
    part(1);
    ++frame;
  });
  candidates.emplace_back("two threads", 1.0, [&] {
    go.arrive_and_wait();
    const double start = thread_seconds();
    part(0);
    const double own_cpu_s = thread_seconds() - start;
    done.arrive_and_wait();
    longer_part_ms.push_back(1e3 * std::max(own_cpu_s, helper_cpu_s));
    sum_of_parts_ms.push_back(1e3 * (own_cpu_s + helper_cpu_s));
    ++frame;
  });
  time_interleaved(candidates, kTimed);
  more = false;
  go.arrive_and_wait();
  helper.join();
  const Candidate& one = candidates[0];
  const Candidate& two = candidates[1];
  std::printf(
      "  %-48s one thread, of a processor: median %7.3f  least %7.3f ms; on the wall: median %7.3f  least %7.3f\n",
      name, 1e-6 * one.cpu_median(), 1e-6 * one.cpu_quantile(0.0), 1e-6 * one.median(), 1e-6 * one.quantile(0.0));
  std::printf(
      "  %-48s two threads, the longer part: median %7.3f, both parts: median %7.3f; on the wall: median %7.3f  least "
      "%7.3f\n",
      "", quantile(longer_part_ms, 0.5), quantile(sum_of_parts_ms, 0.5), 1e-6 * two.median(), 1e-6 * two.quantile(0.0));
  std::printf(
      "  %-48s speed-up by the longer part's processor time %.2f, on the wall %.2f by medians, %.2f by the least\n", "",
      1e-6 * one.cpu_median() / quantile(longer_part_ms, 0.5), one.median() / two.median(),
      one.quantile(0.0) / two.quantile(0.0));
}

template <class Real>
void bench_frames(const char* precision, int features) {
  const Scene scene(5, features);
  const auto name = [&](const char* what) {
    return std::string(precision) + ", " + std::to_string(features) + ", " + what;
  };
  Fed<Real> light(scene, 1, 2);
  bench_frame(name("1 + 2 phases, 1 update").c_str(), light,
              [](Fed<Real>& bank, int group, int frame) { bank.learn_group(group, frame); });
  Fed<Real> draining(scene, kLearnPerFrame, 1 + static_cast<int>(kReleasesCovered), kLearnPerFrame);
  bench_frame(name("the daemon's, draining").c_str(), draining,
              [](Fed<Real>& bank, int group, int frame) { bank.drain_group(group, frame); });
}

}  // namespace
}  // namespace perimap::bench

int main() {
  using namespace perimap;
  using namespace perimap::bench;
  print_machine(PERIMAP_REVISION);
  for (const int harmonics : {3, 5, 8, 10}) bench_updates(harmonics);
  std::printf(
      "\nOne frame at H = 5, 3 iterations an update; 60 fps leave 16.7 ms. The daemon's worst frame: %d learnt phases "
      "with\n"
      "an update each, capture and %d releases predicted\n",
      kLearnPerFrame, static_cast<int>(kReleasesCovered));
  bench_frames<double>("double", 10'000);
  bench_frames<float>("float", 10'000);
  bench_frames<double>("double", 112);
  return 0;
}
