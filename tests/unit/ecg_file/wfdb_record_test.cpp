// WFDB records as files beside each other.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/ecg_file/wfdb.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

// Two signals of format 16: 100, 200, no value; and -5, -6, -7.
constexpr std::string_view kHeader =
    "x 2 500 3\n"
    "x.dat 16 100 16 0 100 1 0 MLII\n"
    "x.dat 16 100(-5)/mV 16 0 -5 -18 0 V5\n";
constexpr std::string_view kSamples = "\x64\x00\xFB\xFF\xC8\x00\xFA\xFF\x00\x80\xF9\xFF"sv;

class WfdbRecord : public testing::Test {
 protected:
  WfdbRecord() {
    std::string name = (fs::temp_directory_path() / "perimap-wfdb-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    write("x.dat", kSamples);
  }
  ~WfdbRecord() override { fs::remove_all(folder_); }
  WfdbRecord(const WfdbRecord&) = delete;
  WfdbRecord& operator=(const WfdbRecord&) = delete;

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, std::string_view content) const {
    ASSERT_TRUE(write_text_file(folder_ / name, content));
  }
  [[nodiscard]] std::string error_of(std::string_view header, const std::string& signal = "1") const {
    write("x.hea", header);
    const auto trace = read_wfdb(path("x.hea"), signal);
    return trace ? "" : trace.error().message;
  }

 private:
  fs::path folder_;
};

TEST_F(WfdbRecord, FindsItsSamplesBesideItsHeader) {
  // The checksum of the first signal: 100 + 200 - 32768 modulo 2^16, as header(5) writes it.
  write("x.hea", "x 2 500 3\nx.dat 16 100 16 0 100 -32468 0 MLII\nx.dat 16 100(-5)/mV 16 0 -5 -18 0 V5\n");
  const auto first = read_wfdb(path("x.hea"), "1");
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_EQ(first->trace.mV.size(), 3U);
  EXPECT_FLOAT_EQ(first->trace.mV[0], 1.0F);
  EXPECT_FLOAT_EQ(first->trace.mV[1], 2.0F);
  EXPECT_TRUE(std::isnan(first->trace.mV[2]));
  EXPECT_EQ(first->trace.time_s, (std::vector<double>{0.0, 0.002, 0.004}));
  const auto second = read_wfdb(path("x.hea"), "v5");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_FLOAT_EQ(second->trace.mV[0], 0.0F);
  EXPECT_FLOAT_EQ(second->trace.mV[2], -0.02F);
}

TEST_F(WfdbRecord, NamesTheFileThatIsWrong) {
  EXPECT_NE(error_of(kHeader).find("x.dat: the samples of signal 1 do not have the checksum 1"), std::string::npos);
  for (const char* signal : {"0", "3", "-1", "aVR"}) {
    EXPECT_EQ(error_of(kHeader, signal), path("x.hea") + ": there is no signal " + signal + "; it has 2: 1 MLII, 2 V5");
  }
  EXPECT_EQ(error_of("x 1 500 3\nnone.dat 16\n"),
            path("none.dat") + ": expected a readable WFDB signal file, got: No such file or directory");
  EXPECT_EQ(error_of("x 1 500 3\n../x.dat 16\n"), path("x.hea") + ": its signals must lie in its folder or below");
  EXPECT_EQ(error_of("x 1 500 3\n/dev/zero 16\n"), path("x.hea") + ": its signals must lie in its folder or below");
  EXPECT_EQ(error_of("x 1 500 9\nx.dat 16\n"), path("x.dat") + ": byte 12: the file ends after 6 of 9 samples");
  EXPECT_EQ(error_of("x 1 500 3\nx.dat 8\n"),
            path("x.dat") + ": signal 1 is of format 8; 16, 24, 32, 61, 80 and 212 are read");
  EXPECT_EQ(error_of(""), path("x.hea") + ": there is no record line in it");
  EXPECT_NE(error_of(std::string((1 << 20) + 1, '#')).find("x.hea: is too long for a WFDB header"), std::string::npos);
  const auto nothing = read_wfdb(path("nothing.hea"), "");
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().message,
            path("nothing.hea") + ": expected a readable WFDB header, got: No such file or directory");
}

TEST_F(WfdbRecord, LiesInAFolderOrWhereItWasCopiedTo) {
  write("x.hea", "folder/x 1 500 6\nfolder/x.dat 16 100/mV 16 0 100 0 0 II\n");
  const auto beside = read_wfdb(path("x.hea"), "");
  ASSERT_TRUE(beside) << beside.error().message;
  EXPECT_EQ(beside->trace.mV.size(), 6U);
  EXPECT_EQ(beside->description, "II");
  fs::create_directory(path("folder"));
  write("folder/x.dat", "\x05\x00\x05\x00\x05\x00\x05\x00\x05\x00\x05\x00"sv);
  const auto below = read_wfdb(path("x.hea"), "");
  ASSERT_TRUE(below) << below.error().message;
  EXPECT_FLOAT_EQ(below->trace.mV[0], 0.05F);
  EXPECT_EQ(wfdb_files(path("x.hea"))[1], fs::path(path("folder/x.dat")));
}

TEST_F(WfdbRecord, ZeroIsNoChecksum) {
  write("x.hea", "x 2 500 3\nx.dat 16 100 16 0 100 0 0 MLII\nx.dat 16 100(-5)/mV 16 0 -5 0 0 V5\n");
  EXPECT_TRUE(read_wfdb(path("x.hea"), "1"));
}

TEST_F(WfdbRecord, TellsWhichFilesItIs) {
  write("x.hea", "x 2 500\nx.dat 16\ny.dat 16\n");
  EXPECT_EQ(wfdb_files(path("x.hea")), (std::vector<fs::path>{path("x.hea"), path("x.dat"), path("y.dat")}));
  write("x.hea", "garbled");
  EXPECT_EQ(wfdb_files(path("x.hea")), std::vector<fs::path>{path("x.hea")});
  EXPECT_EQ(wfdb_files(path("nothing.hea")), std::vector<fs::path>{path("nothing.hea")});
}

}  // namespace
}  // namespace perimap
