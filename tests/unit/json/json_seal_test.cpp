#include "drivers/json/json_seal.hpp"

#include <gtest/gtest.h>

#include <string>

#include "drivers/json/json_text.hpp"
#include "tests/unit/damage/damage.hpp"

namespace perimap {
namespace {

nlohmann::json registration() {
  return {{"translation_mm", {1.5, -2.25, 0.1}},
          {"rotation_wxyz", {1.0, 0.0, 0.0, 0.0}},
          {"made_from", "gef\xE4\xDF.csv"},  // bytes of another encoding
          {"covariance", nullptr},
          {"points", 12}};
}

TEST(JsonSeal, HoldsAsItWasWrittenAndWhenItIsSealedAnew) {
  const nlohmann::json sealed = sealed_json(registration());
  EXPECT_TRUE(check_json_seal(nlohmann::json::parse(json_document(sealed))));
  EXPECT_TRUE(check_json_seal(nlohmann::json::parse(json_line(sealed)))) << "spaces and line ends say nothing";
  EXPECT_EQ(sealed_json(sealed), sealed);
  EXPECT_EQ(sealed["points"], 12);
}

TEST(JsonSeal, OfAnObjectWithoutOneNothingIsAsked) { EXPECT_TRUE(check_json_seal(registration())); }

TEST(JsonSeal, IsBrokenByAnotherValueAnotherKeyAndASealThatIsNone) {
  const nlohmann::json sealed = sealed_json(registration());
  for (const nlohmann::json& change :
       {nlohmann::json{{"points", 13}}, nlohmann::json{{"more", 1}}, nlohmann::json{{"perimap_crc32", 7}},
        nlohmann::json{{"perimap_crc32", "00000000"}}}) {
    nlohmann::json changed = sealed;
    changed.update(change);
    const auto checked = check_json_seal(changed);
    ASSERT_FALSE(checked) << change;
    EXPECT_NE(checked.error().message.find("takes the key 'perimap_crc32' away"), std::string::npos);
  }
}

// What is left reads as JSON, and says what it said: a space is another, or the key of the seal has another name.
TEST(JsonSeal, OfDamagedOnesThoseHoldThatSayTheSame) {
  const std::string whole = json_document(sealed_json(registration()));
  nlohmann::json said = nlohmann::json::parse(json_document(registration()));
  test::Damage damage;
  for (int trial = 0; trial < test::Damage::kCopies; ++trial) {
    const std::string damaged = damage.copy_of(whole);
    nlohmann::json read = nlohmann::json::parse(damaged, nullptr, false);
    if (!read.is_object() || !check_json_seal(read)) continue;
    for (const auto& [key, value] : said.items()) EXPECT_EQ(read.at(key), value) << damaged;
  }
}

}  // namespace
}  // namespace perimap
