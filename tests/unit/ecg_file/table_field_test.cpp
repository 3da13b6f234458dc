#include "drivers/ecg_file/table_field.hpp"

#include <gtest/gtest.h>

namespace perimap {
namespace {

TEST(TableField, IsTakenOutOfSpacesAndQuotes) {
  EXPECT_EQ(bare(" a b\t"), "a b");
  EXPECT_EQ(bare("\"a\""), "a");
  EXPECT_EQ(bare("' a '"), "a");
  EXPECT_EQ(bare("\"\""), "");
  EXPECT_EQ(bare("  "), "");
  EXPECT_EQ(bare("\"a'"), "\"a'");
  EXPECT_EQ(bare("\""), "\"");
  EXPECT_EQ(bare(" ' "), "'");
}

TEST(TableField, IsANumberAsAWhole) {
  EXPECT_EQ(to_number(" -1.5e2 "), -150.0);
  EXPECT_EQ(to_number("\"2\""), 2.0);
  for (const char* text : {"", " ", "1x", "x1", "1 2", "--1", "0x", "1;2", "0:00.5"}) {
    EXPECT_FALSE(to_number(text)) << text;
  }
}

TEST(TableField, LineHasOneMoreThanCommas) {
  EXPECT_EQ(fields_of(" a ,,'b'"), (std::vector<std::string_view>{"a", "", "b"}));
  EXPECT_EQ(fields_of(""), (std::vector<std::string_view>{""}));
  EXPECT_EQ(fields_of(","), (std::vector<std::string_view>{"", ""}));
}

TEST(TableField, KnowsTheNamesOfTimes) {
  for (const char* name : {"time", "time_s", "Time", "TIME (s)", " time", "'Elapsed time'", "\"elapsed_time_s\"",
                           "Timestamp", "ElapsedTime", "times", "t", "T [s]", "t_s", "Seconds"}) {
    EXPECT_TRUE(is_time_name(name)) << name;
  }
  for (const char* name : {"", " ", "mV", "MLII", "sample #", "'sample #'", "centimetre", "multimeter", "V5", "tan",
                           "lead t", "1", "\x80\xFF"}) {
    EXPECT_FALSE(is_time_name(name)) << name;
  }
}

}  // namespace
}  // namespace perimap
