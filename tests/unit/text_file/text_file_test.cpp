#include "drivers/text_file/text_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace perimap {
namespace {

class TextFile : public testing::Test {
 protected:
  ~TextFile() override { std::filesystem::remove(file_); }

  // More than is read at once, and no two places alike.
  static std::string long_text() {
    std::string text;
    for (int i = 0; text.size() < 300'000; ++i) text += std::to_string(i) + '\n';
    return text;
  }

  // Each case is a process of its own, beside the others.
  const std::filesystem::path file_ =
      testing::TempDir() + "text_file_" + testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(TextFile, IsReadWholeWhateverItsLength) {
  for (const std::string& text : {std::string(), std::string("a\0b\n", 4), long_text()}) {
    ASSERT_TRUE(write_text_file(file_, text));
    const auto read = read_text_file(file_, 1'000'000, "text");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(*read == text) << read->size() << " bytes of " << text.size();
  }
}

TEST_F(TextFile, TooLongGivesOneByteMoreThanIsAllowed) {
  const std::string text = long_text();
  ASSERT_TRUE(write_text_file(file_, text));
  for (const std::size_t largest :
       {std::size_t{0}, std::size_t{10}, std::size_t{65'535}, std::size_t{65'536}, std::size_t{200'000}}) {
    EXPECT_EQ(read_text_file(file_, largest, "text").value(), text.substr(0, largest + 1)) << largest;
  }
  EXPECT_EQ(read_text_file(file_, text.size(), "text").value().size(), text.size());
}

TEST_F(TextFile, WhatCannotBeReadIsNamed) {
  const auto none = read_text_file("none.toml", 100, "configuration file");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "none.toml: expected a readable configuration file, got: No such file or directory");
  const auto folder = read_text_file(".", 100, "configuration file");
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().message, ".: expected a readable configuration file, got: Is a directory");
}

}  // namespace
}  // namespace perimap
