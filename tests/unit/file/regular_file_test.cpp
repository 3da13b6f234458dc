#include "drivers/file/regular_file.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

class RegularFile : public testing::Test {
 protected:
  RegularFile() {
    std::string name = testing::TempDir() + "regular-file-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~RegularFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

TEST_F(RegularFile, IsOpened) {
  std::ofstream(folder_ / "file") << "abc";
  const auto opened = open_regular_file(folder_ / "file");
  ASSERT_TRUE(opened) << opened.error();
  char text[4] = {};
  EXPECT_EQ(read(opened->get(), text, 3), 3);
  EXPECT_STREQ(text, "abc");
}

// The opening of a pipe without a writer would never return.
TEST_F(RegularFile, APipeIsRefusedAtOnce) {
  const auto pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(open_regular_file(pipe).error(), "a pipe, and no file");
  EXPECT_EQ(read_text_file(pipe, 100, "configuration file").error().message,
            pipe.string() + ": expected a readable configuration file, got: a pipe, and no file");
}

TEST_F(RegularFile, WhatElseIsNoFileIsNamed) {
  EXPECT_EQ(open_regular_file("/dev/null").error(), "a device, and no file");
  EXPECT_EQ(open_regular_file(folder_).error(), "Is a directory");
  EXPECT_EQ(open_regular_file(folder_ / "none").error(), "No such file or directory");
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = (folder_ / "socket").string();
  ASSERT_LT(path.size(), sizeof address.sun_path);
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(open_regular_file(path).error(), "a socket, and no file");
  close(listener);
}

}  // namespace
}  // namespace perimap
