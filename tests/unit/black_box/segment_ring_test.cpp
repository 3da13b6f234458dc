// What a black box keeps and lets go, and what it does on a disk that is full.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "written_log.hpp"

namespace perimap::black_box::test {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Ring : public WrittenLog {};

TEST_F(Ring, IsForItsOwnerAlone) {
  SegmentRing log = ring();
  write(log, seconds(1));
  struct stat status {};
  ASSERT_EQ(::stat(segment(1).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  ASSERT_EQ(::stat(folder_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0700U);
}

TEST_F(Ring, WithoutEventsHasTheLastMinutesAlone) {
  SegmentRing log = ring();
  write(log, minutes(20));
  end(log);
  EXPECT_LE(numbers().size(), 12U);
  EXPECT_GE(numbers().size(), 10U);
  EXPECT_TRUE(verified().whole());
}

TEST_F(Ring, KeepsWhatLiesAroundAnEvent) {
  SegmentRing log = ring();
  write(log, minutes(10));
  const std::uint64_t event = numbers().back();
  log.keep_around_now();
  write(log, minutes(20));
  for (const std::uint64_t number : {event - 2, event - 1, event, event + 1}) {
    EXPECT_THAT(numbers(), Contains(number));
  }
  EXPECT_THAT(numbers(), Not(Contains(event - 4)));
  EXPECT_THAT(numbers(), Not(Contains(event + 3)));
  end(log);
  EXPECT_TRUE(verified().whole());
}

TEST_F(Ring, KeepsItInTheNextRunToo) {
  {
    SegmentRing log = ring();
    log.keep_around_now();
    write(log, seconds(40));
    end(log);
  }
  SegmentRing log = ring();
  write(log, minutes(20));
  EXPECT_THAT(numbers(), Contains(1U));
}

TEST_F(Ring, LetsGoOfEventsThatAreOldEnough) {
  limits_.keep = std::chrono::hours(24);
  SegmentRing log = ring();
  log.keep_around_now();
  write(log, seconds(40));
  pass(std::chrono::hours(25));
  write(log, seconds(40));
  EXPECT_THAT(numbers(), Not(Contains(1U)));
  end(log);
  EXPECT_TRUE(verified().whole());
}

TEST_F(Ring, TakesNoMoreBytesThanItMayAndWhatNoEventHoldsGoesFirst) {
  limits_.bytes = 1 << 20;
  limits_.ring = std::chrono::hours(10);
  SegmentRing log = ring();
  log.keep_around_now();
  const std::string large(20'000, 'x');
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(log.write({EntryKind::kLog, now_, large}));
    pass(seconds(1));
  }
  std::uintmax_t bytes = 0;
  for (const std::uint64_t number : numbers()) bytes += std::filesystem::file_size(segment(number));
  EXPECT_LE(bytes, limits_.bytes);
  EXPECT_THAT(numbers(), Contains(1U));
  end(log);
  EXPECT_TRUE(verified().whole());
}

TEST_F(Ring, OfAnotherProcessIsRefused) {
  const SegmentRing log = ring();
  const auto second = SegmentRing::open(folder_, limits_, {}, [] { return Stamp{}; });
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another process writes its black box there"));
}

TEST_F(Ring, AWriteThatFailsLeavesWholeEntriesAndGoesOn) {
  SegmentRing log = ring();
  write(log, seconds(2));
  const auto size = std::filesystem::file_size(segment(1));
  // As a full disk: part of an entry is written, the rest refused.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{size + 10, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  const auto refused = log.write({EntryKind::kLog, now_, "info: a line"});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ::signal(SIGXFSZ, handler);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("segment-00000001: cannot be written: File too large"));
  EXPECT_EQ(std::filesystem::file_size(segment(1)), size);
  write(log, seconds(2));
  end(log);
  EXPECT_TRUE(verified().whole());
}

TEST_F(Ring, WhatAnInterruptedBeginningHasLeftGoes) {
  { SegmentRing log = ring(); }
  put(folder_ / "segment-00000001.part", "PERIM");
  SegmentRing log = ring();
  write(log, seconds(1));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "segment-00000001.part"));
  EXPECT_THAT(numbers(), ElementsAre(1U));
}

TEST_F(Ring, EachSegmentHasTheConfiguration) {
  SegmentRing log = ring();
  ASSERT_TRUE(log.write_configuration(now_, "a = 1\n"));
  write(log, seconds(65));
  end(log);
  for (const std::uint64_t number : numbers()) {
    int configurations = 0;
    const auto found = verify(segment(number), [&](const Entry& entry) {
      configurations += entry.kind == EntryKind::kConfiguration && entry.content == "a = 1\n" ? 1 : 0;
    });
    ASSERT_TRUE(found);
    EXPECT_EQ(configurations, 1) << number;
  }
}

}  // namespace
}  // namespace perimap::black_box::test
