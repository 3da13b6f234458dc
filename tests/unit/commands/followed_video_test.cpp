#include "daemon/evaluation/tracking/followed_video.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "daemon/evaluation/tracking/frame_source.hpp"
#include "daemon/evaluation/tracking/track_table.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;

class Tracks : public testing::Test {
 protected:
  Tracks() {
    std::string name = testing::TempDir() + "tracks-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~Tracks() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

TEST_F(Tracks, AreARowEachInATableThatIsThereWhenItIsWhole) {
  const std::string file = (folder_ / "tracks.csv").string();
  auto table = TrackTable::create(file);
  ASSERT_TRUE(table) << table.error().message;
  const std::array<TrackRow, 2> rows{{{0, 7, {1.5, 2.25}, false}, {1, 8, {3.0, 4.0}, true}}};
  table->write(rows);
  EXPECT_EQ(table->rows(), 2U);
  EXPECT_FALSE(std::filesystem::exists(file));
  ASSERT_TRUE(table->finish());
  std::ifstream stream(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}),
            "frame,id,x,y,state\n0,7,1.500,2.250,tracked\n1,8,3.000,4.000,candidate\n");
}

TEST_F(Tracks, OfWhatCannotBeReadAreRefused) {
  std::ofstream(folder_ / "text") << "no video";
  EXPECT_FALSE(FrameSource::open((folder_ / "text").string()));
  const auto none = FrameSource::open((folder_ / "none").string());
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("none: there is no such file"));
  std::ofstream(folder_ / "cut.mcap") << "\x89MCAP0\r\n";
  EXPECT_THAT(FrameSource::open((folder_ / "cut.mcap").string()).error().message, HasSubstr("cut.mcap"));
}

TEST(FollowSummary, WarnsWhereHardlyAnythingWasFound) {
  FollowSettings settings;
  settings.input = "dark.avi";
  settings.table = "tracks.csv";
  FollowSummary summary;
  summary.frames = 10;
  summary.rows = 2000;
  EXPECT_TRUE(warnings(summary, settings).empty());
  EXPECT_EQ(to_text(summary, settings),
            "10 frames, 200.0 features a frame, 0.00 ms a frame to follow them: tracks.csv\n");
  summary.poor_frames = 3;
  ASSERT_EQ(warnings(summary, settings).size(), 1U);
  EXPECT_THAT(warnings(summary, settings)[0], HasSubstr("in 3 of 10 frames fewer than a tenth of 200 features"));
  summary.poor_frames = 6;
  EXPECT_THAT(warnings(summary, settings)[0], HasSubstr("dark.avi: hardly any features could be found"));
  summary.stopped = true;
  EXPECT_THAT(to_text(summary, settings), ::testing::StartsWith("stopped early: "));
}

}  // namespace
}  // namespace perimap
