#include "daemon/command_line/progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace perimap {
namespace {

// Elsewhere than on a terminal.
TEST(Progress, IsALineEachTenthOfTheWayWithTheProgramsName) {
  testing::internal::CaptureStderr();
  {
    Progress progress(Console("prog replay"), "frames", 100);
    for (std::uint64_t done = 1; done <= 100; ++done) progress.update(done);
  }
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_THAT(told, testing::StartsWith("prog replay:  10% 10/100 frames, "));
  EXPECT_THAT(told, testing::HasSubstr("\nprog replay: 100% 100/100 frames, "));
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 10);
}

}  // namespace
}  // namespace perimap
