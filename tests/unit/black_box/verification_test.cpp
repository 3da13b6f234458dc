// What verify-log takes for whole, and what it does not.
#include <gmock/gmock.h>

#include "tests/unit/damage/damage.hpp"
#include "written_log.hpp"

namespace perimap::black_box::test {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Verifying : public WrittenLog {
 protected:
  // Three segments, of a run that has ended.
  void write_whole() {
    SegmentRing log = ring();
    log.keep_around_now();
    write(log, seconds(75));
    end(log);
  }
};

TEST_F(Verifying, ARunThatHasEndedIsWhole) {
  write_whole();
  const Verification found = verified();
  EXPECT_TRUE(found.whole());
  EXPECT_THAT(found.faults, IsEmpty());
  EXPECT_EQ(found.segments, 3U);
  EXPECT_EQ(found.entries, 75U + 3U + 3U) << "a header and an end each";
}

TEST_F(Verifying, ARunThatWasKilledIsAsItWasWrittenButNotWhole) {
  SegmentRing log = ring();
  write(log, seconds(5));
  const Verification found = verified();
  EXPECT_FALSE(found.whole());
  EXPECT_THAT(found.faults, IsEmpty());
}

TEST_F(Verifying, TheNextRunGoesOnFromOneThatWasKilled) {
  {
    SegmentRing log = ring();
    write(log, seconds(5));
  }
  SegmentRing log = ring();
  EXPECT_THAT(log.take_findings(), ElementsAre(HasSubstr("segment 1 has no end")));
  write(log, seconds(5));
  end(log);
  const Verification found = verified();
  EXPECT_TRUE(found.whole());
  EXPECT_THAT(found.notes, ElementsAre(HasSubstr("has no end, as the next run found it")));
}

TEST_F(Verifying, AnEntryThatAStoppedMachineHasLeftInPartIsToldAndNoFault) {
  {
    SegmentRing log = ring();
    write(log, seconds(5));
  }
  std::string bytes = bytes_of(segment(1));
  bytes.resize(bytes.size() - 7);
  put(segment(1), bytes);
  EXPECT_THAT(verified().faults, ElementsAre(HasSubstr("entry 5, byte"))) << "nobody says yet that it was so";
  {
    SegmentRing log = ring();
    write(log, seconds(1));
    end(log);
  }
  EXPECT_TRUE(verified().whole());
  put(segment(1), bytes + "x");
  EXPECT_FALSE(verified().whole());
}

TEST_F(Verifying, WhatIsCutFromARunAtAnEntryIsNoticed) {
  {
    SegmentRing log = ring();
    write(log, seconds(5));
  }
  const std::string before = bytes_of(segment(1));
  {
    SegmentRing log = ring();
    write(log, seconds(1));
    end(log);
  }
  std::size_t last_entry = kEntryFrame + std::string("info: a line").size();
  put(segment(1), before.substr(0, before.size() - last_entry));
  EXPECT_THAT(verified().faults, ElementsAre(HasSubstr("as segment-00000002 has it")));
}

TEST_F(Verifying, ASegmentThatIsTakenOutIsNoticed) {
  write_whole();
  std::filesystem::remove(segment(2));
  EXPECT_THAT(verified().faults, ElementsAre(HasSubstr("tells of segment 2, which is not there")));
}

TEST_F(Verifying, WithoutItsLastSegmentItIsNotWhole) {
  write_whole();
  std::filesystem::remove(segment(3));
  EXPECT_THAT(verified().faults, IsEmpty());
  EXPECT_FALSE(verified().whole());
}

TEST_F(Verifying, OfSegmentsThatOthersHaveRemovedTheNextRunTells) {
  write_whole();
  std::filesystem::remove(segment(2));
  {
    SegmentRing log = ring();
    write(log, seconds(1));
    EXPECT_THAT(log.take_findings(), ElementsAre(HasSubstr("segment 2 was removed, not by perimapd")));
    end(log);
  }
  EXPECT_TRUE(verified().whole());
  EXPECT_THAT(verified().notes, ElementsAre(HasSubstr("segment 2: removed by others")));
}

TEST_F(Verifying, OfOneSegmentNothingIsAskedOfTheOthers) {
  write_whole();
  for (const std::uint64_t number : numbers()) {
    const auto found = verify(segment(number), {});
    ASSERT_TRUE(found);
    EXPECT_TRUE(found->whole()) << number;
  }
}

TEST_F(Verifying, SegmentsThatChangePlacesAreNoticed) {
  write_whole();
  std::filesystem::rename(segment(1), folder_ / "x");
  std::filesystem::rename(segment(2), segment(1));
  std::filesystem::rename(folder_ / "x", segment(2));
  EXPECT_THAT(verified().faults.front(), HasSubstr("segment-00000001: its header says that it is segment 2"));
}

TEST_F(Verifying, BitFlipsAndCutsAreNeverTakenForWhole) {
  write_whole();
  perimap::test::Damage damage;
  for (int trial = 0; trial < perimap::test::Damage::kCopies; ++trial) {
    const auto file = segment(1 + damage.one_of(3));
    const std::string whole = bytes_of(file);
    const std::string damaged = damage.copy_of(whole);
    put(file, damaged);
    EXPECT_FALSE(verified().whole()) << file << " " << damaged.size();
    put(file, whole);
  }
  EXPECT_TRUE(verified().whole());
}

struct Garbled {
  const char* name;
  std::string (*garble)(std::string);
  const char* told;
};

class GarbledSegment : public WrittenLog, public ::testing::WithParamInterface<Garbled> {};

TEST_P(GarbledSegment, IsRefusedAndSaysWhere) {
  {
    SegmentRing log = ring();
    write(log, seconds(2));
    end(log);
  }
  put(segment(1), GetParam().garble(bytes_of(segment(1))));
  const Verification found = verified();
  ASSERT_FALSE(found.faults.empty());
  EXPECT_THAT(found.faults.front(), HasSubstr((segment(1).string() + ": entry ") + GetParam().told));
}

std::size_t second_entry(const std::string& bytes) {
  std::uint32_t length = 0;
  bytes.copy(reinterpret_cast<char*>(&length), 4, 12);
  return 12 + kEntryFrame + length;
}

std::string with(std::string bytes, std::size_t at, char value) {
  bytes[at] = value;
  return bytes;
}

INSTANTIATE_TEST_SUITE_P(
    Bytes, GarbledSegment,
    ::testing::Values(
        Garbled{"empty", [](std::string) { return std::string(); }, "0, byte 0: expected a segment of a black box"},
        Garbled{"another_file", [](std::string) { return std::string("\x89MCAP0\r\n and more"); },
                "0, byte 0: expected 'PERIMAPB'"},
        Garbled{"another_format", [](std::string b) { return with(b, 8, 2); }, "0, byte 0: expected 'PERIMAPB'"},
        Garbled{"no_header", [](std::string b) { return b.substr(0, 12); }, "0, byte 12: expected a header"},
        Garbled{"huge_length", [](std::string b) { return with(b, second_entry(b) + 3, 0x7f); }, "1, byte"},
        Garbled{"kind_that_is_none", [](std::string b) { return with(b, second_entry(b) + 4, 99); }, "1, byte"},
        Garbled{"zeros_that_are_none", [](std::string b) { return with(b, second_entry(b) + 6, 1); }, "1, byte"},
        Garbled{"content", [](std::string b) { return with(b, second_entry(b) + kEntryHead, 'x'); }, "1, byte"},
        Garbled{"without_first", [](std::string b) { return b.substr(0, 12) + b.substr(second_entry(b)); },
                "0, byte 12: its digest does not fit"},
        Garbled{"behind_the_end", [](std::string b) { return b + "x"; }, "4, byte"}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace perimap::black_box::test
