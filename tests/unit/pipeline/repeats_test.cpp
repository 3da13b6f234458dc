#include "core/pipeline/repeats.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

using std::chrono::milliseconds;

Instant at(int ms) { return Instant(milliseconds(ms)); }

TEST(Repeats, AreLongEnoughAfterHalfASecondOfTheSame) {
  Repeats repeats;
  repeats.add(false, at(1000));
  EXPECT_FALSE(repeats.long_enough());
  for (int ms = 1010; ms < 1500; ms += 10) repeats.add(true, at(ms));
  EXPECT_FALSE(repeats.long_enough());
  repeats.add(true, at(1500));
  EXPECT_TRUE(repeats.long_enough());
  EXPECT_EQ(repeats.since(), at(1000)) << "the reading that is given again";
}

TEST(Repeats, EndWithAReadingThatIsNew) {
  Repeats repeats;
  repeats.add(false, at(0));
  repeats.add(true, at(2000));
  ASSERT_TRUE(repeats.long_enough());
  repeats.add(false, at(2010));
  EXPECT_FALSE(repeats.long_enough());
}

TEST(Repeats, OfASensorThatIsAskedMoreOftenThanItMeasuresAreNone) {
  Repeats repeats;
  for (int i = 0; i < 300; ++i) {
    repeats.add(i % 3 != 0, at(10 * i));
    EXPECT_FALSE(repeats.long_enough());
  }
}

}  // namespace
}  // namespace perimap
