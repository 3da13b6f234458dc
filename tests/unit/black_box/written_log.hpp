// A black box that a test writes, on a clock of its own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "daemon/black_box/segment_folder.hpp"
#include "daemon/black_box/segment_ring.hpp"
#include "daemon/black_box/verification.hpp"

namespace perimap::black_box::test {

class WrittenLog : public ::testing::Test {
 protected:
  WrittenLog() {
    std::string name = (std::filesystem::temp_directory_path() / "black-box-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    folder_ /= "box";
  }
  ~WrittenLog() override { std::filesystem::remove_all(folder_.parent_path()); }

  [[nodiscard]] SegmentRing ring() {
    SegmentHeader whose;
    whose.program = "perimapd test";
    whose.source = "a";
    whose.run = "00";
    auto opened = SegmentRing::open(folder_, limits_, whose, [this] { return now_; });
    if (!opened) throw std::runtime_error(opened.error().message);
    return std::move(*opened);
  }
  void pass(std::chrono::nanoseconds time) {
    now_.monotonic_ns += time.count();
    now_.utc_ns += time.count();
  }
  // An entry a second for so long.
  void write(SegmentRing& ring, std::chrono::seconds time) {
    for (auto left = time; left.count() > 0; left -= std::chrono::seconds(1)) {
      const auto written = ring.write({EntryKind::kLog, now_, "info: a line"});
      ASSERT_TRUE(written) << written.error().message;
      pass(std::chrono::seconds(1));
    }
  }
  void end(SegmentRing& ring) { ASSERT_TRUE(ring.end(kRunHasEnded)); }

  [[nodiscard]] Verification verified() const {
    auto found = verify(folder_, {});
    if (!found) throw std::runtime_error(found.error().message);
    return std::move(*found);
  }
  [[nodiscard]] std::filesystem::path segment(std::uint64_t number) const { return segment_path(folder_, number); }
  [[nodiscard]] std::vector<std::uint64_t> numbers() const { return segment_numbers(folder_).value(); }

  static std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void put(const std::filesystem::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }

  std::filesystem::path folder_;
  RingLimits limits_;
  Stamp now_{1'000'000'000, 1'700'000'000'000'000'000};
};

}  // namespace perimap::black_box::test
