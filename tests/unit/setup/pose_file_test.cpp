#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/pose_file/number_table.hpp"
#include "drivers/pose_file/point_table.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

std::string pose_error(std::string_view text, LengthUnit unit = LengthUnit::kMetre) {
  const auto table = parse_pose_table(text, "poses.csv", unit);
  return table ? "accepted" : table.error().message;
}

TEST(PoseTable, IsReadWhateverItsHeadingAndSeparators) {
  for (const std::string_view text :
       {"t_s,x,y,z,qx,qy,qz,qw\n1.5,0.1,0.2,-0.3,0,0,0,1\n", "1.5,0.1,0.2,-0.3,0,0,0,1\n",
        "a;b;c;d;e;f;g;h\r\n1.5;0.1;0.2;-0.3;0;0;0;1\r\n",
        "# comment\n\"t\"\tx\ty\tz\ti\tj\tk\tw\n1.5\t0.1\t0.2\t-0.3\t0\t0\t0\t1", "1.5  0.1 0.2 -0.3   0 0 0 1\n",
        "\xEF\xBB\xBFt,x,y,z,qx,qy,qz,qw\n1.5, 0.1, 0.2, -0.3, 0, 0, 0, 1\n"}) {
    const auto table = parse_pose_table(text, "poses.csv", LengthUnit::kMetre);
    ASSERT_TRUE(table) << table.error().message;
    ASSERT_EQ(table->poses.size(), 1U);
    EXPECT_EQ(table->poses[0].t_s, 1.5);
    EXPECT_LT((table->poses[0].X.t - Vector3d(100.0, 200.0, -300.0)).norm(), 1e-9);
  }
}

TEST(PoseTable, TakesMatrices) {
  const auto table = parse_pose_table("0,0,-1,0,10,1,0,0,20,0,0,1,30\n", "poses.csv", LengthUnit::kMillimetre);
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_LT((table->poses[0].X.t - Vector3d(10.0, 20.0, 30.0)).norm(), 1e-12);
  EXPECT_NEAR(table->poses[0].X.R(1, 0), 1.0, 1e-12);
}

TEST(PoseTable, CountsDropouts) {
  const auto table =
      parse_pose_table("0,0,0,0,0,0,0,1\n1,nan,nan,nan,nan,nan,nan,nan\n2,,,,,,,\n3,0,0,0,0,0,0,0\n4,0,0,0,0,0,0,1\n",
                       "poses.csv", LengthUnit::kMetre);
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->poses.size(), 2U);
  EXPECT_EQ(table->dropouts, 3U);
}

TEST(PoseTable, NamesLineAndFault) {
  EXPECT_THAT(pose_error("t,x\n1,2\n"), HasSubstr("poses.csv:2: expected 8 columns"));
  EXPECT_THAT(pose_error("0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0\n"), HasSubstr("poses.csv:2: expected 8 fields"));
  EXPECT_THAT(pose_error("0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,x\n"), HasSubstr("poses.csv:2: expected a number, got 'x'"));
  EXPECT_THAT(pose_error("0,0,0,0,0,0,0,2\n"), HasSubstr("norm 1"));
  EXPECT_THAT(pose_error("0,1,0,0,10,0,1,0,20,0,0,-1,30\n"), HasSubstr("are a rotation"));
  EXPECT_THAT(pose_error("0,800,0,0,0,0,0,1\n"), HasSubstr("--unit mm"));
  EXPECT_THAT(pose_error(""), HasSubstr("no numbers"));
  EXPECT_THAT(pose_error("t,x,y,z,qx,qy,qz,qw\n"), HasSubstr("no numbers"));
}

// As a device writes them: `rate` times a second from `first`, in `unit`ths of a second.
std::string timed_rows(double first, double rate, std::size_t count, double unit, std::string_view rest) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    text += fmt::format("{:.0f}{}\n", (first + static_cast<double>(i) / rate) * unit, rest);
  }
  return text;
}

TEST(TableTimes, ThatAreNoSecondsAreRefusedByTheUnitThatTheyLookLike) {
  constexpr std::string_view kPose = ",0,0,0,0,0,0,1";
  constexpr double kToday = 1764244800.0;
  for (const double first : {0.0, kToday}) {
    for (const auto& [name, unit] : {std::pair("ns", 1e9), std::pair("us", 1e6), std::pair("ms", 1e3)}) {
      for (const double rate : {15.0, 30.0, 100.0}) {
        const std::string text = timed_rows(first, rate, 4000, unit, kPose);
        EXPECT_THAT(pose_error(text), testing::AllOf(HasSubstr("poses.csv: "), HasSubstr("seconds"),
                                                     HasSubstr(fmt::format("--time-unit {}", name))));
        const auto signal = parse_signal_table(timed_rows(first, rate, 4000, unit, ",1"), "signal.csv");
        ASSERT_FALSE(signal);
        EXPECT_THAT(signal.error().message, HasSubstr(fmt::format("are they {}?", name)));
      }
    }
  }
}

TEST(TableTimes, ThatAreSlowAreAskedAboutAndMayBeSeconds) {
  const std::string slow = timed_rows(0.0, 0.1, 3000, 1.0, ",0,0,0,0,0,0,1");  // every ten seconds, for eight hours
  EXPECT_THAT(pose_error(slow), HasSubstr("10 s from one to the next"));
  EXPECT_THAT(pose_error(slow), HasSubstr("or with --time-unit s if they are seconds"));
  const auto table = parse_pose_table(slow, "poses.csv", LengthUnit::kMetre, TimeUnit::kSecond);
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_NEAR(table->poses[1].t_s, 10.0, 1e-9);
}

TEST(TableTimes, AreSecondsOfTheUnitThatIsSaid) {
  const auto table = parse_pose_table(timed_rows(0.0, 100.0, 3, 1e9, ",0,0,0,0,0,0,1"), "poses.csv", LengthUnit::kMetre,
                                      TimeUnit::kNanosecond);
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_NEAR(table->poses[2].t_s, 0.02, 1e-9);
  const auto signal = parse_signal_table("0,1\n30,2\n", "signal.csv", TimeUnit::kMillisecond);
  ASSERT_TRUE(signal);
  EXPECT_NEAR(signal->values[1].t_s, 0.03, 1e-12);
}

TEST(TableTimes, OfARobotsStopsOfRowsAndOfOurYearsAreSeconds) {
  constexpr std::string_view kPose = ",0,0,0,0,0,0,1";
  for (const std::string& text : {timed_rows(0.0, 1.0 / 60.0, 150, 1.0, kPose),       // a stop a minute
                                  timed_rows(0.0, 1.0, 5000, 1.0, kPose),             // numbers of rows
                                  timed_rows(1764244800.0, 0.2, 300, 1.0, kPose)}) {  // since 1970
    EXPECT_EQ(pose_error(text), "accepted");
  }
}

TEST(TableTimes, AreSecondsThoughARowOfZerosStandsWhereTheToolWasHidden) {
  std::string text = timed_rows(1764244800.0, 5.0, 300, 1.0, ",0,0,0,0,0,0,1");
  text += "0,0,0,0,0,0,0,0\n";
  const auto table = parse_pose_table(text, "poses.csv", LengthUnit::kMetre);
  EXPECT_TRUE(table) << table.error().message;
}

TEST(SignalTable, TakesTheDirectionOfMostMotion) {
  std::string text = "t,x,y,z\n";
  for (int i = 0; i < 100; ++i)
    text += std::to_string(0.1 * i) + "," + std::to_string(0.6 * i) + "," + std::to_string(0.8 * i) + ",5\n";
  const auto table = parse_signal_table(text, "signal.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_TRUE(table->several_columns);
  EXPECT_NEAR(std::abs(table->values[10].value - table->values[0].value), 10.0, 1e-6);
}

TEST(PointTable, IsReadAndRefusesWhatIsTwice) {
  const auto points = parse_point_table("name,x,y,z\nnose, 1,2,3\near,4,5,6\n", "points.csv", LengthUnit::kMillimetre);
  ASSERT_TRUE(points) << points.error().message;
  ASSERT_EQ(points->size(), 2U);
  EXPECT_EQ((*points)[0].name, "nose");
  EXPECT_THAT(parse_point_table("a,1,2,3\na,1,2,3\n", "p", LengthUnit::kMillimetre).error().message, HasSubstr("p:2"));
  EXPECT_THAT(parse_point_table("a,1,2\n", "p", LengthUnit::kMillimetre).error().message, HasSubstr("p:1"));
  EXPECT_THAT(parse_point_table("", "p", LengthUnit::kMillimetre).error().message, HasSubstr("no points"));
}

// Garbled bytes give an error or numbers, never more rows than lines.
TEST(Tables, SurviveGarbledBytes) {
  std::mt19937 generator(1);
  const std::string sound = "t_s,x,y,z,qx,qy,qz,qw\n1.5,0.1,0.2,-0.3,0,0,0,1\n2.5,0.1,0.2,-0.3,0,0,0,1\n";
  for (int trial = 0; trial < 5000; ++trial) {
    std::string text = sound;
    for (int k = 0; k < 1 + trial % 5; ++k) text[generator() % text.size()] = static_cast<char>(generator());
    const auto table = parse_number_table(text, "t");
    if (table) {
      EXPECT_LE(table->rows.size(), text.size());
    } else {
      EXPECT_EQ(table.error().message.find('\n'), std::string::npos);
    }
    (void)parse_pose_table(text, "t", LengthUnit::kMetre);
    (void)parse_signal_table(text, "t");
    (void)parse_point_table(text, "t", LengthUnit::kMetre);
  }
}

}  // namespace
}  // namespace perimap
