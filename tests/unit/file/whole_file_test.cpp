#include "drivers/file/whole_file.hpp"

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "drivers/file/group_access.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

class WholeFileTest : public testing::Test {
 protected:
  WholeFileTest() {
    std::string name = testing::TempDir() + "whole-file-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~WholeFileTest() override { std::filesystem::remove_all(folder_); }

  static std::string content(const std::filesystem::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const { return std::distance(std::filesystem::directory_iterator(folder_), {}); }

  std::filesystem::path folder_;
};

// Files may not grow beyond this while it lives, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(WholeFileTest, WhatADescriptorHoldsIsWrittenToAndNotReplaced) {
  const auto file = folder_ / "out.txt";
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_GE(descriptor, 0);
  const auto link = folder_ / "link";
  std::filesystem::create_symlink("/dev/fd/" + std::to_string(descriptor), link);
  for (const auto& name : {std::filesystem::path("/dev/fd/" + std::to_string(descriptor)),
                           std::filesystem::path("/proc/self/fd/" + std::to_string(descriptor)), link}) {
    auto whole = WholeFile::create(name);
    ASSERT_TRUE(whole) << whole.error().message;
    std::ofstream(whole->path()) << name.string();
    ASSERT_TRUE(whole->finish());
    struct stat held {
    }, named{};
    ASSERT_EQ(fstat(descriptor, &held), 0);
    ASSERT_EQ(stat(file.c_str(), &named), 0);
    EXPECT_EQ(held.st_ino, named.st_ino) << name;
    EXPECT_EQ(content(file), name.string());
  }
  // Another link is no descriptor.
  EXPECT_TRUE(is_special("/dev/null"));
  std::filesystem::create_symlink("out.txt", folder_ / "other");
  EXPECT_FALSE(is_special(folder_ / "other"));
  close(descriptor);
}

TEST_F(WholeFileTest, HasItsNameWhenItIsFinishedAndNotBefore) {
  const auto file = folder_ / "a.txt";
  auto whole = WholeFile::create(file);
  ASSERT_TRUE(whole) << whole.error().message;
  std::ofstream(whole->path()) << "all of it";
  EXPECT_FALSE(std::filesystem::exists(file));
  ASSERT_TRUE(whole->finish());
  EXPECT_EQ(content(file), "all of it");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFileTest, WhatIsNotFinishedLeavesTheOldOneAsItWas) {
  const auto file = folder_ / "a.txt";
  std::ofstream(file) << "old";
  {
    auto whole = WholeFile::create(file);
    ASSERT_TRUE(whole) << whole.error().message;
    std::ofstream(whole->path()) << "half of the n";
  }
  EXPECT_EQ(content(file), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFileTest, OnAFullDiskTheErrorNamesTheFileAndTheOldOneStays) {
  const auto file = folder_ / "a.txt";
  ASSERT_TRUE(write_text_file(file, "old"));
  Expected<void> written;
  {
    const FullDisk full(4096);
    written = write_text_file(file, std::string(100'000, 'x'));
  }
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().message, file.string() + ": cannot be written: File too large");
  EXPECT_EQ(content(file), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFileTest, AFolderThatTakesNoneIsToldBeforeAnythingIsWritten) {
  const auto file = folder_ / "none" / "a.txt";
  EXPECT_EQ(WholeFile::create(file).error().message, file.string() + ": cannot be written: No such file or directory");
  EXPECT_EQ(check_writable(file).error().message, file.string() + ": cannot be written: No such file or directory");
  EXPECT_EQ(check_writable(folder_).error().message, folder_.string() + ": cannot be written: Is a directory");
  EXPECT_TRUE(check_writable(folder_ / "b.txt"));
  EXPECT_EQ(files(), 0);
}

TEST_F(WholeFileTest, AnEndingThatTellsTheKindIsKept) {
  auto whole = WholeFile::create(folder_ / "a.mkv", WholeFile::Name::kPartWithEnding);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->path(), folder_ / "a.mkv.part.mkv");
}

TEST_F(WholeFileTest, WhatIsLeftOfAnEarlierRunStays) {
  const auto file = folder_ / "a.txt";
  std::ofstream(folder_ / "a.txt.part") << "all that came";
  auto whole = WholeFile::create(file);
  ASSERT_TRUE(whole) << whole.error().message;
  auto another = WholeFile::create(file, WholeFile::Name::kPartWithEnding);
  ASSERT_TRUE(another) << another.error().message;
  EXPECT_EQ(whole->path(), folder_ / "a.txt.part-2");
  EXPECT_EQ(another->path(), folder_ / "a.txt.part.txt");
  EXPECT_EQ(WholeFile::create(file, WholeFile::Name::kPartWithEnding)->path(), folder_ / "a.txt.part-2.txt");
  ASSERT_TRUE(check_writable(file));
  std::ofstream(whole->path()) << "new";
  ASSERT_TRUE(whole->finish());
  EXPECT_EQ(content(file), "new");
  EXPECT_EQ(content(folder_ / "a.txt.part"), "all that came");
}

TEST_F(WholeFileTest, ALinkStaysALinkToWhatIsWritten) {
  std::filesystem::create_directory(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere" / "a.txt") << "old";
  std::filesystem::create_symlink(folder_ / "elsewhere" / "a.txt", folder_ / "link");
  ASSERT_TRUE(write_text_file(folder_ / "link", "new"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(folder_ / "elsewhere" / "a.txt"), "new");
}

TEST_F(WholeFileTest, KeepsThePermissionsOfTheFileThatItReplaces) {
  const auto file = folder_ / "a.txt";
  ASSERT_TRUE(write_text_file(file, "old"));
  std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  ASSERT_TRUE(write_text_file(file, "new"));
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(WholeFileTest, WhatIsNoFileIsWrittenToDirectly) {
  EXPECT_TRUE(write_text_file("/dev/null", "text"));
  EXPECT_EQ(write_text_file("/dev/full", "text").error().message,
            "/dev/full: cannot be written: No space left on device");
  EXPECT_TRUE(std::filesystem::exists("/dev/full"));
}

TEST_F(WholeFileTest, WhatNobodyCouldMakeAgainMayBeKept) {
  std::filesystem::path partial;
  {
    auto whole = WholeFile::create(folder_ / "a.txt");
    ASSERT_TRUE(whole);
    partial = whole->path();
    std::ofstream(partial) << "what came";
    whole->keep_unfinished();
  }
  EXPECT_EQ(content(partial), "what came");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.txt"));
}

TEST_F(WholeFileTest, ForItsOwnerAloneIsReadByNobodyElseWhateverWasThereBefore) {
  const std::filesystem::path file = folder_ / "patient.mcap";
  std::ofstream(file) << "old";
  std::filesystem::permissions(file, std::filesystem::perms(0644));
  auto whole = WholeFile::create(file, WholeFile::Name::kPart, WholeFile::Readers::kOwner);
  ASSERT_TRUE(whole);
  EXPECT_EQ(std::filesystem::status(whole->path()).permissions(), std::filesystem::perms(0600))
      << "from the beginning on";
  std::ofstream(whole->path()) << "new";
  ASSERT_TRUE(whole->finish());
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0600));
}

TEST_F(WholeFileTest, AGroupMayReadWhatItIsGivenAndAGroupThatIsNotThereIsTold) {
  const std::filesystem::path file = folder_ / "patient.mcap";
  std::ofstream(file) << "x";
  std::filesystem::permissions(file, std::filesystem::perms(0600));
  const ::group* own = ::getgrgid(::getegid());
  ASSERT_NE(own, nullptr);
  ASSERT_TRUE(let_group_read(file, own->gr_name));
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0640));
  const auto unknown = let_group_read(file, "no-such-group");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().message,
            file.string() + ": cannot be given to the group 'no-such-group': there is no such group on this machine");
}

}  // namespace
}  // namespace perimap
