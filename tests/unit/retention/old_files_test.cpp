#include "daemon/retention/old_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace perimap {
namespace {

namespace fs = std::filesystem;
using std::chrono::days;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class OldFiles : public ::testing::Test {
 protected:
  OldFiles() {
    std::string path = (fs::temp_directory_path() / "perimap-old-XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) throw std::runtime_error("no folder");
    folder_ = path;
  }
  ~OldFiles() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  void write(const std::string& name, const std::string& text, days age) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    fs::last_write_time(folder_ / name, now_ - age);
  }
  std::vector<std::string> older_than(days age) {
    std::vector<std::string> names;
    const auto found = old_files(folder_, age, now_);
    if (!found) throw std::runtime_error(found.error().message);
    for (const OldFile& file : *found) names.push_back(file.path.filename().string());
    return names;
  }

  fs::path folder_;
  fs::file_time_type now_ = fs::file_time_type::clock::now();
  const std::string recording_ = std::string("\x89MCAP0\r\n", 8) + "rest";
};

TEST_F(OldFiles, RecordingsCheckpointsAndBlackBoxesAreFoundByWhatTheyBeginWithOldestFirst) {
  write("a.mcap", recording_, days(31));
  write("renamed.bin", recording_, days(40));
  write("checkpoint", "PERIMAPC and more", days(35));
  write("b.mcap.part", recording_, days(33));
  write("empty.mcap", "", days(50));
  write("segment-00000001", "PERIMAPB and more", days(60));
  EXPECT_THAT(older_than(days(30)),
              ElementsAre("segment-00000001", "empty.mcap", "renamed.bin", "checkpoint", "b.mcap.part", "a.mcap"));
}

TEST_F(OldFiles, WhatIsYoungerOrOfSomethingElseStays) {
  write("young.mcap", recording_, days(29));
  write("notes.txt", "not a patient's", days(100));
  write("video.mcap", "not what its name says", days(100));
  write("short", "PERI", days(100));
  fs::create_directory(folder_ / "folder.mcap");
  fs::create_symlink(folder_ / "young.mcap", folder_ / "link.mcap");
  EXPECT_THAT(older_than(days(30)), ElementsAre());
}

TEST_F(OldFiles, AreRemovedAndNothingElseIs) {
  write("a.mcap", recording_, days(31));
  write("young.mcap", recording_, days(1));
  const auto found = old_files(folder_, days(30), now_);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().bytes, recording_.size());
  EXPECT_GE(found->front().age, days(31));
  ASSERT_TRUE(remove_old(found->front()));
  synchronise_folder(folder_);
  EXPECT_FALSE(fs::exists(folder_ / "a.mcap"));
  EXPECT_TRUE(fs::exists(folder_ / "young.mcap"));
}

TEST_F(OldFiles, OfSeveralFoldersGoWhateverOneOfThemDoes) {
  write("a.mcap", recording_, days(31));
  write("young.mcap", recording_, days(1));
  std::vector<std::string> told;
  std::vector<std::string> faults;
  const auto forget = [&](bool dry) {
    told.clear();
    faults.clear();
    return forget_old(
        {"/nowhere/at/all", folder_.string()}, days(30), dry,
        [&](const OldFile& file) { told.push_back(file.path.filename().string()); },
        [&](const Error& error) { faults.push_back(error.message); });
  };
  for (const bool dry : {true, false}) {
    const Forgotten forgotten = forget(dry);
    EXPECT_EQ(forgotten.files, 1U);
    EXPECT_EQ(forgotten.bytes, recording_.size());
    EXPECT_TRUE(forgotten.failed);
    EXPECT_THAT(told, ElementsAre("a.mcap"));
    EXPECT_THAT(faults, ElementsAre(HasSubstr("/nowhere/at/all: cannot be read")));
    EXPECT_EQ(fs::exists(folder_ / "a.mcap"), dry);
  }
  EXPECT_EQ(forget(false).files, 0U);
  EXPECT_TRUE(fs::exists(folder_ / "young.mcap"));
}

TEST(Age, IsReadInHoursDaysAndWeeks) {
  EXPECT_EQ(parse_age("12h").value_or(std::chrono::seconds(0)), std::chrono::hours(12));
  EXPECT_EQ(parse_age("30d").value_or(std::chrono::seconds(0)), days(30));
  EXPECT_EQ(parse_age("8w").value_or(std::chrono::seconds(0)), std::chrono::weeks(8));
  for (const char* wrong : {"", "d", "30", "0d", "-3d", "3m", "1.5d", "30 d", "99999999999999999999d", "100001d"}) {
    EXPECT_THAT(parse_age(wrong).error().message, HasSubstr("expected a number of hours, days or weeks")) << wrong;
  }
}

TEST(Folders, ThatAreNotThereAreToldByName) {
  const auto found = old_files("/nowhere/at/all", days(1), fs::file_time_type::clock::now());
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("/nowhere/at/all: cannot be read"));
}

}  // namespace
}  // namespace perimap
