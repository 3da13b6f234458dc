// The real-time calls of core/vision take nothing from the heap. Allocation is counted where it can happen: operator
// new is replaced here, and calls of the C functions (Eigen's way) are redirected by the linker (--wrap).
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "core/vision/image_pyramid.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace {
std::atomic<long> allocations{0};
}

extern "C" {
void* __real_malloc(std::size_t size);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
}

void* operator new(std::size_t size) {
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace perimap {
namespace {

TEST(Heap, IsNotTouchedByPyramidTemplateOrTracker) {
  std::mt19937 random(1);
  const test::ImageBuffer image = test::render(test::Texture(5), test::View{}, 161, 123, 2, random);
  ImagePyramid pyramid(161, 123, 3);
  PatchTemplate patch;
  PatchState state;

  const long before_probe = allocations;
  void* volatile probe = std::malloc(1);  // volatile, or the compiler leaves the pair out
  std::free(probe);
  int* volatile other_probe = new int(3);
  delete other_probe;
  ASSERT_EQ(allocations - before_probe, 2) << "the count does not work";

  const long before = allocations;
  pyramid.build(image.view());
  const TemplateVerdict verdict = make_patch_template(pyramid, {80.3, 61.2}, TemplateSettings{}, patch);
  const PatchMatch near = track(pyramid, patch, state, {80.9, 61}, test::isotropic(0.5));
  const PatchMatch far = track(pyramid, patch, state, {95, 51}, test::isotropic(8));
  const PatchMatch absent = track(pyramid, patch, state, {40, 100}, test::isotropic(1));
  EXPECT_EQ(allocations, before);

  EXPECT_EQ(verdict, TemplateVerdict::kGood);
  EXPECT_EQ(near.state, MatchState::kFound);
  EXPECT_EQ(far.state, MatchState::kFound);
  EXPECT_NE(absent.state, MatchState::kFound);
}

}  // namespace
}  // namespace perimap
