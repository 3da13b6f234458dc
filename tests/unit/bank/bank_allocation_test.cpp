// The bank, once made, takes nothing from the heap. A program of its own, because it counts the calls of the allocator.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "core/bank/motion_predictor.hpp"

namespace {

std::atomic<long> allocations{0};

}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// The sanitizers own malloc, and tell of its calls.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*, std::size_t),
                                                         void (*free_hook)(const volatile void*));
namespace {
[[maybe_unused]] const int kHooks = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { allocations.fetch_add(1, std::memory_order_relaxed); },
    [](const volatile void*) {});
}  // namespace
#else
// operator new ends here too.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#endif

namespace perimap {
namespace {

template <class Function>
long allocations_of(Function function) {
  const long before = allocations.load();
  function();
  return allocations.load() - before;
}

TEST(Allocation, IsCounted) {
  void* volatile taken = nullptr;
  EXPECT_GT(allocations_of([&] { taken = std::malloc(100); }), 0);
  std::free(taken);
  int* volatile made = nullptr;
  EXPECT_GT(allocations_of([&] { made = new int[50]; }), 0);
  delete[] made;
}

template <class Real, class Model>
void expect_no_allocation(const Model& model, const Vector3d& ahead_C) {
  const BasisLayout layout{8, 1};
  BankSettings settings{.layout = layout, .features = 3 * kLanes, .noise_mm2_per_s = Basis::Ones(layout.size())};
  FeatureBank<Real> bank(settings);
  MotionPredictor<Real> predictor(bank.groups());
  const FeatureEstimate start = prior_estimate(layout, Prior{.dc_mm = 1.0}, ahead_C);
  FeatureEstimate estimate;
  int accepted = 0;
  const long count = allocations_of([&] {
    for (int f = 0; f < bank.features(); ++f) bank.set(f, start);
    for (int k = 0; k < 10; ++k) {
      SweepPhases<Real> phases;
      phases.add_learnt(basis_at(layout, 0.3 * k, 0.1 * k), basis_rate(layout, 0.3 * k), 7.0, 0.01);
      phases.add_predicted(basis_at(layout, 0.5 * k), basis_rate(layout, 0.5 * k), 7.0, 0.01);
      Vector2d z;
      (void)model.predict(ahead_C, z);
      for (int g = 0; g < bank.groups(); ++g) {
        bank.sweep(g, phases);
        predictor.predict(bank, g, phases, 0);
        LaneObservations<Real> measured;
        for (int lane = 0; lane < kLanes; ++lane) measured.set(lane, z, 1e-2 * Matrix2d::Identity());
        LaneOutcomes<Real> outcomes;
        bank.update(g, phases, 0, Pose{}, model, measured, UpdateSettings{}, outcomes);
        accepted += outcomes.accepted != 0 ? 1 : 0;
        predictor.predict_at(bank, g, phases[1]);
      }
      bank.get(k, estimate);
      bank.add_process_noise(k, 0.1);
      bank.inflate(k, 1.1);
      bank.clear(k + 10);
    }
  });
  EXPECT_EQ(count, 0);
  EXPECT_EQ(accepted, 10 * bank.groups());
}

TEST(Allocation, TheBankTakesNothingFromTheHeap) {
  const PixelModel model{CameraModel{
      .width = 640, .height = 480, .fx = 520.0, .fy = 525.0, .cx = 310.0, .cy = 250.0, .k1 = -0.3, .k2 = 0.1}};
  expect_no_allocation<double>(model, Vector3d(5, -3, 80));
  expect_no_allocation<float>(model, Vector3d(5, -3, 80));
  expect_no_allocation<double>(BearingModel{}, Vector3d(80, -3, 5));
}

}  // namespace
}  // namespace perimap
