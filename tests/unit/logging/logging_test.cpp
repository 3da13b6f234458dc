#include "daemon/logging/logging.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>
#include <string>
#include <thread>

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

TEST(Logging, WritesTheLevelsAskedForAndLeavesTheOthersOut) {
  ::testing::internal::CaptureStderr();
  {
    Logging logging("perimapd", LogConfiguration::Level::kWarning);
    spdlog::info("unheard");
    spdlog::warn("camera {} gone", 3);
    EXPECT_FALSE(logging.next_loss());
  }
  const std::string output = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(output, MatchesRegex("perimapd: [-0-9]+ [0-9:.]+ warning: camera 3 gone\n"));
  EXPECT_THAT(output, Not(HasSubstr("unheard")));
}

// Standard error that takes nothing: a pipe that nobody reads from.
TEST(Logging, TellsOnceHowManyLinesWereDropped) {
  constexpr int kLines = 10'000;  // more than the queue and the pipe hold
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const int standard_error = dup(STDERR_FILENO);
  ASSERT_EQ(dup2(ends[1], STDERR_FILENO), STDERR_FILENO);
  close(ends[1]);
  std::optional<std::string> first, second;
  std::thread reader;
  {
    Logging logging("perimapd", LogConfiguration::Level::kInfo);
    for (int i = 0; i < kLines; ++i) spdlog::info("line {}", i);
    first = logging.next_loss();
    second = logging.next_loss();
    reader = std::thread([&] {
      char taken[4096];
      while (read(ends[0], taken, sizeof taken) > 0) {
      }
    });
  }
  dup2(standard_error, STDERR_FILENO);  // the last of the pipe's writers
  reader.join();
  close(standard_error);
  close(ends[0]);
  ASSERT_TRUE(first);
  EXPECT_THAT(*first,
              MatchesRegex("[0-9]+ lines of this log were dropped, since standard error takes them too slowly"));
  EXPECT_GT(std::stoi(*first), kLines - 8000);
  EXPECT_FALSE(second);
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
