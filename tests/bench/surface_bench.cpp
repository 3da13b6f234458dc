// What a surface costs: made of features, and evaluated. See run.sh.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <vector>

#include "core/surface/surface_mesh.hpp"
#include "machine_text.hpp"
#include "made_organ.hpp"

namespace perimap::bench {
namespace {

constexpr BasisLayout kEightHarmonics{8, 0};

// Time of this thread on its core, so that what else the machine does hardly counts.
double core_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

// The middle of some rounds, ms.
template <class Function>
double milliseconds(int rounds, Function function) {
  std::vector<double> times;
  for (int i = 0; i < rounds; ++i) {
    const double begin = core_ms();
    function();
    times.push_back(core_ms() - begin);
  }
  std::nth_element(times.begin(), times.begin() + rounds / 2, times.end());
  return times[static_cast<std::size_t>(rounds / 2)];
}

// As test::evidence_at, with the harmonics of a pipeline's defaults.
std::vector<SurfaceEvidence> features(std::size_t count) {
  std::mt19937_64 random(1);
  const double apart_mm = 30.0 / std::sqrt(static_cast<double>(count));
  auto evidence = test::evidence_on(test::places_on_disc(count, 40.0, apart_mm, random), 0.1, random);
  for (SurfaceEvidence& feature : evidence) {
    Eigen::Matrix3Xd c = Eigen::Matrix3Xd::Zero(3, kEightHarmonics.size());
    const int few = test::kLayout.size();
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k <= test::kLayout.cardiac_harmonics; ++k) {
        c(axis, k) = feature.x(axis * few + k);
        if (k > 0) c(axis, 8 + k) = feature.x(axis * few + test::kLayout.cardiac_harmonics + k);
      }
    }
    feature.x = test::state_of(c);
  }
  return evidence;
}

void run() {
  std::printf(
      "| features | learn kernels anew and fit, ms | from nearby, ms | fit, ms | 1000 vertices, ms "
      "|\n|---|---|---|---|---|\n");
  for (const std::size_t count : {20U, 50U, 100U, 200U, 500U}) {
    const auto evidence = features(count);
    const int rounds = count > 200 ? 3 : 11;
    std::optional<PeriodicSurface> surface;
    const auto fit = [&](const SurfaceKernels& kernels, KernelSearch search) {
      surface.emplace(PeriodicSurface::fit(kEightHarmonics, evidence, Vector3d::Zero(), {}, kernels, search).value());
    };
    const double learnt = milliseconds(rounds, [&] { fit({}, KernelSearch::kAnew); });
    const SurfaceKernels kernels = surface->kernels();
    const double near = milliseconds(rounds, [&] { fit(kernels, KernelSearch::kNearby); });
    const double fitted = milliseconds(rounds, [&] { fit(kernels, KernelSearch::kNone); });
    SurfaceMesh mesh;
    const double meshed = milliseconds(rounds, [&] { mesh = mesh_of(*surface, 1200); });
    std::printf("| %zu | %.1f | %.1f | %.2f | %.2f (%d) |\n", count, learnt, near, fitted, meshed,
                static_cast<int>(mesh.vertices()));
  }
  std::printf("\n| vertices | evaluate, ms |\n|---|---|\n");
  const auto evidence = features(100);
  const auto surface = PeriodicSurface::fit(kEightHarmonics, evidence, Vector3d::Zero());
  for (const std::size_t vertices : {1200U, 2400U, 6000U}) {
    const SurfaceMesh mesh = mesh_of(*surface, vertices);
    EvaluatedSurface evaluated(mesh);
    double phase = 0.0;
    double sum = 0.0;
    const double time = milliseconds(201, [&] {
      phase += 0.1;
      evaluated.evaluate(mesh, basis_at(kEightHarmonics, phase), basis_rate(kEightHarmonics, phase), 0.05);
      sum += evaluated.positions()(0, 0);
    });
    std::printf("| %d | %.3f |\n", static_cast<int>(mesh.vertices()), sum == 0.0 ? 0.0 : time);
  }
}

}  // namespace
}  // namespace perimap::bench

int main() {
  perimap::bench::print_machine(PERIMAP_REVISION);
  perimap::bench::run();
  return 0;
}
