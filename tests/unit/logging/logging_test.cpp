#include "daemon/logging/logging.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

TEST(Logging, WritesTheLevelsAskedForAndLeavesTheOthersOut) {
  ::testing::internal::CaptureStderr();
  {
    const Logging logging("perimapd", LogConfiguration::Level::kWarning);
    spdlog::info("unheard");
    spdlog::warn("camera {} gone", 3);
    EXPECT_EQ(logging.overruns(), 0U);
  }
  const std::string output = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(output, MatchesRegex("perimapd: [-0-9]+ [0-9:.]+ warning: camera 3 gone\n"));
  EXPECT_THAT(output, Not(HasSubstr("unheard")));
}

TEST(Logging, MarksSeverityWhenStandardErrorIsTheJournal) {
  ::testing::internal::CaptureStderr();
  struct stat status {};
  ASSERT_EQ(fstat(STDERR_FILENO, &status), 0);
  setenv("JOURNAL_STREAM", (std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino)).c_str(), 1);
  {
    const Logging logging("perimapd", LogConfiguration::Level::kInfo);
    spdlog::error("lead off");
  }
  unsetenv("JOURNAL_STREAM");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "<3>lead off\n");
}

}  // namespace
}  // namespace perimap
