#include "drivers/calibration/verification_record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace perimap {
namespace {

using testing::HasSubstr;
using testing::Not;

// As perimap verify tells it.
nlohmann::json result() {
  return {{"passed", true},
          {"bound_mm", 2.0},
          {"board_error_mm", 0.3},
          {"board_error_mm_deviation", 0.05},
          {"clock_error_ms", -0.4},
          {"clock_error_ms_deviation", 0.2},
          {"touch_error_mm", 0.8},
          {"touch_error_mm_deviation", 0.1},
          {"date", "2026-11-27 13:00 UTC"}};
}

VerifiedSetUp set_up() {
  VerifiedSetUp of;
  of.translation_SC_mm = {1.0 / 3.0, -4.0, 41.5};
  of.rotation_SC_wxyz = {0.6, 0.0, 0.8, 0.0};
  of.time_offset_ms = 34.49;
  CameraModel camera;
  camera.width = 640, camera.height = 480, camera.fx = 736.3, camera.k1 = -0.2;
  of.lens = lens_numbers(camera);
  return of;
}

TEST(VerificationRecord, IsReadAsItWasWritten) {
  const auto record = parse_verification(format_verification(result().dump(), set_up()), "v.json");
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_TRUE(record->passed);
  EXPECT_FALSE(record->is_doubtful());
  EXPECT_EQ(record->date, "2026-11-27 13:00 UTC");
  EXPECT_EQ(record->board_mm.error, 0.3);
  EXPECT_EQ(record->clocks_ms.error, -0.4);
  ASSERT_TRUE(record->touch_mm);
  EXPECT_EQ(record->touch_mm->deviation, 0.1);
  EXPECT_EQ(record->set_up, set_up());
}

TEST(VerificationRecord, SaysInALineWhatItWas) {
  const std::string text = format_verification(result().dump(), set_up());
  EXPECT_EQ(words_of(*parse_verification(text, "v.json")),
            "passed on 2026-11-27 13:00 UTC, bound 2 mm: board 0.30 mm (deviation 0.05), clocks -0.4 ms (0.2), touched "
            "point 0.80 mm (0.10)");
  nlohmann::json failed = result();
  failed["passed"] = false;
  failed["touch_error_mm"] = nullptr;
  const auto record = parse_verification(format_verification(failed.dump(), set_up()), "v.json");
  EXPECT_TRUE(record->is_doubtful());
  EXPECT_THAT(words_of(*record), HasSubstr("FAILED on"));
  EXPECT_THAT(words_of(*record), HasSubstr("no point was touched; measure again"));
}

TEST(VerificationRecord, OfAnotherSetUpIsDoubtful) {
  const auto record = parse_verification(as_changed_since(format_verification(result().dump(), set_up())), "v.json");
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_TRUE(record->passed);
  EXPECT_TRUE(record->is_doubtful());
  EXPECT_THAT(words_of(*record), HasSubstr("have been changed since"));
  VerifiedSetUp other = set_up();
  other.lens[2] += 1e-9;
  EXPECT_NE(other, set_up());
}

TEST(VerificationRecord, GarbledTextIsRefusedByName) {
  for (const auto& [key, value] : {std::pair<const char*, nlohmann::json>{"date", 5},
                                   {"passed", "yes"},
                                   {"board_error_mm", nullptr},
                                   {"touch_error_mm", "0.8"},
                                   {"clock_error_ms_deviation", {1.0}}}) {
    nlohmann::json json = nlohmann::json::parse(format_verification(result().dump(), set_up()));
    json.erase("perimap_crc32");  // else that is what is told
    json[key] = value;
    const auto record = parse_verification(json.dump(), "v.json");
    ASSERT_FALSE(record) << key;
    EXPECT_THAT(record.error().message, HasSubstr(std::string("v.json: key '") + key + "'"));
  }
  for (const auto& [key, value] : {std::pair<const char*, nlohmann::json>{"hand_eye_translation_SC_mm", {1.0, 2.0}},
                                   {"hand_eye_rotation_SC_wxyz", {1, 0, 0, "0"}},
                                   {"lens", nlohmann::json::array_t(100, 1.0)},
                                   {"turned_scope", std::string(1000, 'x')}}) {
    nlohmann::json json = nlohmann::json::parse(format_verification(result().dump(), set_up()));
    json.erase("perimap_crc32");
    json["set_up"][key] = value;
    const auto record = parse_verification(json.dump(), "v.json");
    ASSERT_FALSE(record) << key;
    EXPECT_THAT(record.error().message, HasSubstr(std::string("v.json: key 'set_up.") + key + "'"));
  }
  nlohmann::json changed = nlohmann::json::parse(format_verification(result().dump(), set_up()));
  changed["passed"] = !changed["passed"].get<bool>();
  EXPECT_THAT(parse_verification(changed.dump(), "v.json").error().message, HasSubstr("v.json: it does not say what"));
  const std::string whole = format_verification(result().dump(), set_up());
  for (std::size_t length = 0; length + 2 < whole.size(); length += 7) {
    EXPECT_FALSE(parse_verification(whole.substr(0, length), "v.json")) << length;
  }
  EXPECT_FALSE(parse_verification("[1, 2]", "v.json"));
  EXPECT_FALSE(parse_verification(result().dump(), "v.json"));
}

TEST(VerificationRecord, StandsBesideTheConfiguration) {
  EXPECT_EQ(verification_file_of("/etc/perimap/perimapd.toml"), "/etc/perimap/perimapd.verified.json");
  EXPECT_EQ(verification_file_of("devices.toml"), "devices.verified.json");
  const auto none = read_verification("/nowhere/devices.verified.json");
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
}

}  // namespace
}  // namespace perimap
