#include "drivers/json/json_text.hpp"

#include <gtest/gtest.h>

#include <string>

namespace perimap {
namespace {

TEST(JsonText, IsADocumentOfManyLinesOrOneLine) {
  const nlohmann::ordered_json json{{"b", 1}, {"a", nlohmann::ordered_json::array({2.5, nullptr})}};
  EXPECT_EQ(json_document(json), "{\n  \"b\": 1,\n  \"a\": [\n    2.5,\n    null\n  ]\n}\n");
  EXPECT_EQ(json_line(json), R"({"b":1,"a":[2.5,null]})");
}

// A file's name in Latin-1, a cut sequence, and an overlong one.
TEST(JsonText, StandsForBytesThatAreNoUtf8) {
  for (const std::string& bytes : {std::string("gef\xE4\xDF"), std::string("\xE2\x82"), std::string("\xC0\xAF/etc")}) {
    const std::string line = json_line(nlohmann::json{{"path", bytes}});
    EXPECT_NE(line.find("\xEF\xBF\xBD"), std::string::npos) << line;
    EXPECT_TRUE(nlohmann::json::accept(line));
    EXPECT_TRUE(nlohmann::json::accept(json_document(nlohmann::json{{"path", bytes}})));
  }
}

}  // namespace
}  // namespace perimap
