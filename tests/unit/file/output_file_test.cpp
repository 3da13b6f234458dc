#include "drivers/file/output_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

namespace perimap {
namespace {

class OutputFile : public testing::Test {
 protected:
  OutputFile() {
    std::string name = testing::TempDir() + "output-file-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~OutputFile() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path make_pipe() const {
    const auto pipe = folder_ / "pipe";
    EXPECT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    return pipe;
  }

  std::filesystem::path folder_;
};

TEST_F(OutputFile, AFileIsMadeForItsOwnerAndEmptiedWhereItIsThere) {
  const auto file = folder_ / "file";
  for (const char* text : {"longer than", "what"}) {
    const auto opened = open_output_file(file);
    ASSERT_TRUE(opened) << opened.error();
    EXPECT_EQ(write(opened->get(), text, std::strlen(text)), static_cast<ssize_t>(std::strlen(text)));
  }
  std::ifstream stream(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), "what");
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

// The opening of a pipe without a reader would never return.
TEST_F(OutputFile, APipeThatNobodyReadsFromIsRefused) {
  EXPECT_EQ(open_output_file(make_pipe()).error(), "a pipe that nobody reads from");
}

TEST_F(OutputFile, AReaderMayBeginALittleLater) {
  const auto pipe = make_pipe();
  int reader = -1;
  std::thread late([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    reader = open(pipe.c_str(), O_RDONLY);
  });
  const auto opened = open_output_file(pipe);
  // Where it was refused, this lets the reader go on.
  if (!opened) close(open(pipe.c_str(), O_RDWR | O_NONBLOCK));
  late.join();
  ASSERT_TRUE(opened) << opened.error();
  EXPECT_EQ(fcntl(opened->get(), F_GETFL) & O_NONBLOCK, 0) << "what is written would not wait for the reader";
  close(reader);
}

TEST_F(OutputFile, TheReasonIsTheSystems) {
  EXPECT_EQ(open_output_file(folder_).error(), "Is a directory");
  EXPECT_EQ(open_output_file(folder_ / "none" / "file").error(), "No such file or directory");
  EXPECT_TRUE(open_output_file("/dev/null"));
}

}  // namespace
}  // namespace perimap
