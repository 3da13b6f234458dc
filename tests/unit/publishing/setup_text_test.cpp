#include "daemon/publishing/setup_text.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/angle/angle.hpp"
#include "core/setup_watch/setup_deviation.hpp"

namespace perimap {
namespace {

perimap_SetupWatch doubt_of(SetupPart part, int number, double by, double deviation) {
  perimap_SetupWatch setup{};
  setup.state = perimap_SETUP_DOUBTED;
  setup.blamed[static_cast<std::size_t>(part)] = true;
  setup.numbers[number] = by;
  setup.deviations[number] = deviation;
  setup.surface_mm = 4.13;
  setup.first_doubted_ns = 14'500'000'000;
  return setup;
}

struct Told {
  SetupPart part;
  int number;
  double by, deviation;
  std::string words, remedy, name;
};

TEST(SetupText, SaysWhichNumberIsOffByHowMuchAndWhatToDo) {
  const Told all[] = {
      {SetupPart::kHandEyeTurn, 1, 3.0 * kDegree, 0.2 * kDegree,
       "turned by 3.0 deg against the hand-eye (+0.0, +3.0, +0.0 about its x, y, z, +- 0.2)",
       "perimap calibrate hand-eye", "hand_eye_turn"},
      {SetupPart::kHandEyeAcross, 3, -5.0, 0.4, "5.0 mm beside where the hand-eye has it (-5.0, +0.0",
       "perimap calibrate hand-eye", "hand_eye_across"},
      {SetupPart::kHandEyeAlong, 5, -6.0, 0.5, "6.0 mm behind where the hand-eye has it (+- 0.5)",
       "perimap calibrate hand-eye", "hand_eye_along"},
      {SetupPart::kFocalLength, 6, 0.031, 0.002, "the focal length is 3.1 % longer than calibrated (+- 0.2)",
       "perimap calibrate camera", "focal_length"},
      {SetupPart::kPrincipalPoint, 8, 12.0, 2.0, "the principal point is (+0, +12) px beside the calibrated one (+- 2)",
       "perimap calibrate camera", "principal_point"},
      {SetupPart::kTimeOffset, 9, 0.03, 0.002, "tracker.time_offset_ms is 30 too small (+- 2)",
       "perimap calibrate time", "time_offset"}};
  for (const Told& told : all) {
    const perimap_SetupWatch setup = doubt_of(told.part, told.number, told.by, told.deviation);
    const std::string words = setup_words(setup);
    EXPECT_NE(words.find("positions are off by 4.1 mm"), std::string::npos) << words;
    EXPECT_NE(words.find(told.words), std::string::npos) << words;
    EXPECT_NE(words.find(told.remedy), std::string::npos) << words;
    const auto json = setup_json(setup);
    EXPECT_EQ(json["number"], told.name);
    EXPECT_EQ(json["doubted"], true);
    EXPECT_EQ(json["doubted_after_s"], 14.5);
  }
}

TEST(SetupText, BlamesNothingWhereNothingIsDoubted) {
  perimap_SetupWatch setup{};
  EXPECT_EQ(setup_words(setup), "not judged yet");
  setup.windows = 5;
  EXPECT_NE(setup_words(setup).find("no motions explain what is seen"), std::string::npos);
  setup.state = perimap_SETUP_CONSISTENT;
  setup.asked = false;
  const auto json = setup_json(setup);
  EXPECT_EQ(json["state"], "consistent");
  EXPECT_EQ(json["doubted"], false);
  EXPECT_EQ(json["asked"], false);
  EXPECT_TRUE(json["number"].is_null());
  EXPECT_TRUE(json["doubted_after_s"].is_null());
}

}  // namespace
}  // namespace perimap
