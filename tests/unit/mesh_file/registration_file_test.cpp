// A registration as a file: read as it was written, or refused by key.
#include "drivers/calibration/registration_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace perimap {
namespace {

using testing::HasSubstr;

const std::string kRows = "[[4,0,0,0,0,0],[0,4,0,0,0,0],[0,0,4,0,0,0],[0,0,0,9,1,0],[0,0,0,1,9,0],[0,0,0,0,0,9]]";
const std::string kWhole = R"({"translation_mm": [1, 2, 3], "rotation_wxyz": [0.6, 0, 0.8, 0], "covariance": )" +
                           kRows + R"(, "covariance_about_mm": [10, 20, 30], "fre_mm": 0.4})";

TEST(RegistrationFile, IsReadAsItWasWritten) {
  const auto registration = parse_registration(kWhole, "start.json");
  ASSERT_TRUE(registration) << registration.error().message;
  EXPECT_EQ(registration->X_IW.t, Vector3d(1, 2, 3));
  EXPECT_NEAR(registration->X_IW.R(0, 0), 0.36 - 0.64, 1e-12);
  ASSERT_TRUE(registration->covariance);
  EXPECT_EQ((*registration->covariance)(3, 4), 1.0);
  EXPECT_EQ(registration->middle_I, Vector3d(10, 20, 30));
}

TEST(RegistrationFile, OfThreeLandmarksHasNoCovariance) {
  const auto registration = parse_registration(
      R"({"translation_mm": [0, 0, 0], "rotation_wxyz": [1, 0, 0, 0], "covariance": null})", "s.json");
  ASSERT_TRUE(registration);
  EXPECT_FALSE(registration->covariance);
}

TEST(RegistrationFile, WhatIsGarbledIsRefusedByKey) {
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"", "s.json: is no JSON object"},
           {"[1, 2]", "is no JSON object"},
           {replaced(kWhole, "[1, 2, 3]", "[1, 2]"), "key 'translation_mm'"},
           {replaced(kWhole, "[1, 2, 3]", "[1, 2, \"3\"]"), "key 'translation_mm'"},
           {replaced(kWhole, "[1, 2, 3]", "[1, 2, 1e9]"), "key 'translation_mm'"},
           {replaced(kWhole, "0.6", "0.7"), "key 'rotation_wxyz' is not the four numbers of a unit quaternion"},
           {replaced(kWhole, "0.6, ", ""), "key 'rotation_wxyz'"},
           {replaced(kWhole, "[4,0,0,0,0,0]", "[-4,0,0,0,0,0]"), "key 'covariance'"},
           {replaced(kWhole, "9,1,0", "9,2,0"), "key 'covariance'"},
           {replaced(kWhole, ",9]]", "]]"), "key 'covariance'"},
           {replaced(kWhole, "[4,", "[1e400,"), "s.json: "},
           {replaced(kWhole, "covariance_about_mm", "about"), "key 'covariance_about_mm'"}}) {
    const auto registration = parse_registration(text, "s.json");
    ASSERT_FALSE(registration) << text;
    EXPECT_THAT(registration.error().message, HasSubstr(message)) << text;
  }
}

}  // namespace
}  // namespace perimap
