#include "daemon/runtime/last_verification.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

namespace perimap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kPassed =
    R"({"passed": true, "bound_mm": 2.0, "board_error_mm": 0.3, "board_error_mm_deviation": 0.05, "clock_error_ms": 0.4,
        "clock_error_ms_deviation": 0.2, "date": "2026-11-27 13:00 UTC"})";

class Verified : public testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "perimap-verified-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    file_ = fs::path(folder) / "devices.toml";
    configuration_.tracker.protocol = TrackerConfiguration::Protocol::kNdi;
    configuration_.tracker.translation_SC_mm[2] = 41.3;
    camera_.emplace();
    camera_->fx = 736.3;
  }
  void TearDown() override { fs::remove_all(file_.parent_path()); }

  void keep(const std::string& text) const { std::ofstream(verification_file_of(file_)) << text; }
  [[nodiscard]] LastVerification last() const { return last_verification(file_, configuration_, camera_); }

  fs::path file_;
  Configuration configuration_;
  std::optional<CameraModel> camera_;
};

TEST_F(Verified, SetUpIsToldWithItsDate) {
  keep(format_verification(kPassed, verified_set_up_of(configuration_, camera_)));
  EXPECT_FALSE(last().doubtful);
  EXPECT_THAT(last().line, StartsWith("set-up verified: passed on 2026-11-27 13:00 UTC"));
  ASSERT_TRUE(last().text);
  EXPECT_FALSE(parse_verification(*last().text, "")->changed_since);
}

TEST_F(Verified, OneThatWasChangedSinceIsDoubted) {
  const std::string text = format_verification(kPassed, verified_set_up_of(configuration_, camera_));
  keep(text);
  configuration_.tracker.time_offset = std::chrono::microseconds(1);
  EXPECT_TRUE(last().doubtful);
  EXPECT_THAT(last().line, HasSubstr("changed since"));
  EXPECT_TRUE(parse_verification(*last().text, "")->changed_since);
  configuration_.tracker.time_offset = Duration(0);
  ASSERT_FALSE(last().doubtful);
  camera_->fx += 0.01;
  EXPECT_TRUE(last().doubtful);
  camera_.reset();
  EXPECT_TRUE(last().doubtful);
}

TEST_F(Verified, OneThatFailedIsDoubted) {
  std::string failed = kPassed;
  failed.replace(failed.find("true"), 4, "false");
  keep(format_verification(failed, verified_set_up_of(configuration_, camera_)));
  EXPECT_TRUE(last().doubtful);
  EXPECT_THAT(last().line, HasSubstr("FAILED"));
}

TEST_F(Verified, NothingIsSaidToBeSo) {
  EXPECT_FALSE(last().doubtful);
  EXPECT_FALSE(last().text);
  EXPECT_THAT(last().line, HasSubstr("has not been verified"));
  keep("{ \"passed\": tru");
  EXPECT_TRUE(last().doubtful);
  EXPECT_FALSE(last().text);
  EXPECT_THAT(last().line, HasSubstr("devices.verified.json"));
  configuration_.tracker.protocol = TrackerConfiguration::Protocol::kNone;
  EXPECT_THAT(last().line, IsEmpty());
}

}  // namespace
}  // namespace perimap
