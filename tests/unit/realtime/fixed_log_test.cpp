#include "core/realtime/fixed_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perimap {
namespace {

TEST(FixedLog, KeepsTheFirstEntriesAndCountsTheRest) {
  FixedLog<int> log(3);
  for (int entry = 1; entry <= 5; ++entry) log.add(entry);
  EXPECT_THAT(log.entries(), testing::ElementsAre(1, 2, 3));
  EXPECT_EQ(log.left_out(), 2U);
}

TEST(FixedLog, ShowsNothingOfTheRoomThatIsNotFilled) {
  FixedLog<int> log(3);
  log.add(7);
  EXPECT_THAT(log.entries(), testing::ElementsAre(7));
  EXPECT_EQ(log.left_out(), 0U);
}

}  // namespace
}  // namespace perimap
