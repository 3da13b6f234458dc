// The real-time calls of core/vision take nothing from the heap.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"
#include "counted_allocations.hpp"
#include "tests/unit/vision/synthetic_scene.hpp"

namespace perimap {
namespace {

TEST(Heap, IsNotTouchedByTemplateOrTracker) {
  std::mt19937 random(1);
  const test::ImageBuffer image = test::render(test::Texture(5), test::View{}, 161, 123, 2, random);
  const PatchTracker tracker;
  PatchTemplate patch;
  PatchState state;

  const long probes = test::allocations_of([] {
    void* volatile probe = std::malloc(1);  // volatile, or the compiler leaves the pair out
    std::free(probe);
    int* volatile other_probe = new int(3);
    delete other_probe;
  });
  ASSERT_EQ(probes, 2) << "the count does not work";

  const long before = test::allocations;
  const TemplateVerdict verdict =
      make_patch_template(image.view(), {80.3, 61.2}, TemplateSettings{}, tracker.kernels(), patch);
  const PatchMatch near = tracker.track(image.view(), patch, state, {80.9, 61}, test::isotropic(0.5));
  const PatchMatch far = tracker.track(image.view(), patch, state, {95, 51}, test::isotropic(8));
  const PatchMatch absent = tracker.track(image.view(), patch, state, {40, 100}, test::isotropic(1));
  EXPECT_EQ(test::allocations, before);

  EXPECT_EQ(verdict, TemplateVerdict::kGood);
  EXPECT_EQ(near.state, MatchState::kFound);
  EXPECT_EQ(far.state, MatchState::kFound);
  EXPECT_NE(absent.state, MatchState::kFound);
}

}  // namespace
}  // namespace perimap
