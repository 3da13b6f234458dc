// Whether the values of several keys go together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <string>

#include "daemon/config/configuration_loader.hpp"

namespace perimap {
namespace {

using ::testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto read = parse_configuration(text, "test.toml");
  return read ? "" : read.error().message;
}

// The default latency is 50 ms: the budget would be more than that.
TEST(KeysTogether, WhetherValuesGoTogetherIsNotToldOfWrongOnes) {
  EXPECT_EQ(error_of("version = 1\n[pipeline]\nlatency_ms = \"80\"\nbudget_ms = 60\n"),
            "test.toml:3:14: key 'pipeline.latency_ms': expected a number from 1 to 1000, got \"80\"");
}

TEST(KeysTogether, WhetherGoodValuesGoTogetherIsToldBesideOtherErrors) {
  std::istringstream lines(
      error_of("[pipeline]\nbudget_ms = 60\n[ecg]\nprotocol = \"bitalino\"\nchannel = 8\nsecond_channel = 7\n[phase]\n"
               "law = 3\n"));
  for (const char* told :
       {"test.toml:1:1: key 'version': expected ", "test.toml:2:13: key 'pipeline.budget_ms': expected less than ",
        "test.toml:5:11: key 'ecg.channel': expected 1 to 6 ",
        "test.toml:6:18: key 'ecg.second_channel': expected 1 to 6 ", "test.toml:8:7: key 'phase.law': expected "}) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line)) << told;
    EXPECT_THAT(line, StartsWith(told));
  }
  EXPECT_EQ(lines.peek(), EOF);
}

// Which key is misspelt nobody knows.
TEST(KeysTogether, WhatMayBeMisspeltIsNotHeldAgainstOthers) {
  EXPECT_EQ(error_of("version = 1\n[pipeline]\nlatncy_ms = 80\nbudget_ms = 60\n").find("budget_ms': expected less"),
            std::string::npos);
}

}  // namespace
}  // namespace perimap
