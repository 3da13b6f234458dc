// The real-time calls of core/vision take nothing from the heap.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_continuity.hpp"
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

TEST(Heap, IsNotTouchedByTheTestOfLooksOrByTheMotionAround) {
  PatchContinuity looks;
  PatchState before, turned;
  turned.A << 0.4, -0.42, 0.34, 1.04;
  constexpr std::size_t kMost = 10;
  NeighbourMotion motion(kMost);

  const long allocations = test::allocations;
  for (int i = 0; i < 20; ++i) looks.add(0.998);
  const bool same = looks.is_plausible(before, before, 0.997, 1);
  const bool other = looks.is_plausible(before, turned, 0.995, 2);
  looks.reset();
  // More than were announced are left out.
  for (std::size_t i = 0; i < 3 * kMost; ++i) motion.add(Vector2d(i, 0), Vector2d(i, 1));
  const NeighbourMotion::Around around = motion.around(Vector2d(5, 5), nullptr);
  motion.clear();
  EXPECT_EQ(test::allocations, allocations);

  EXPECT_TRUE(same);
  EXPECT_FALSE(other);
  EXPECT_TRUE(around.known);
  EXPECT_EQ(around.by, Vector2d(0, 1));
}

}  // namespace
}  // namespace perimap
