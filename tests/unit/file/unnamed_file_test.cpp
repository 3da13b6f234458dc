#include "drivers/file/unnamed_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

#include "drivers/file/whole_file.hpp"

namespace perimap {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(UnnamedFile, IsWrittenAndReadByItsPathUntilItIsGone) {
  auto file = UnnamedFile::create();
  ASSERT_TRUE(file) << file.error().message;
  const std::string path = file->path();
  std::ofstream(path) << "abc";
  EXPECT_EQ(text_of(path), "abc");
  {
    std::optional<UnnamedFile> moved(*std::move(file));
    EXPECT_EQ(moved->path(), path);
    EXPECT_EQ(text_of(path), "abc");
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

// As recordings are written: there is no name that it could get when it is whole.
TEST(UnnamedFile, IsWrittenDirectlyWhereFilesAreThereWhole) {
  const auto file = UnnamedFile::create();
  ASSERT_TRUE(file) << file.error().message;
  auto whole = WholeFile::create(file->path());
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->path(), file->path());
  std::ofstream(whole->path()) << "abc";
  EXPECT_TRUE(whole->finish());
  EXPECT_EQ(text_of(file->path()), "abc");
}

}  // namespace
}  // namespace perimap
