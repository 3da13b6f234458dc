#include "daemon/config/wrong_key.hpp"

#include <gtest/gtest.h>

#include <string>

namespace perimap {
namespace {

TEST(WrongKeys, AreToldAtTheirKeyOrSectionInTheOrderOfTheFile) {
  const std::string text = "version = 1\n[ecg]\nprotocol = \"cyton\"\n[tracker]\n  sensor = \"0A\"\n";
  EXPECT_EQ(told_in("a.toml", text,
                    {{"camera.device", "expected a camera"},
                     {"tracker.sensor", "expected another, got \"0A\""},
                     {"tracker.port", "expected where the device is, got nothing"},
                     {"ecg.port", "expected where the device is, got nothing"},
                     {"tracker.sensor", "expected another, got \"0A\": measure it"}})
                .message,
            "a.toml:2:1: key 'ecg.port': expected where the device is, got nothing\n"
            "a.toml:4:1: key 'tracker.port': expected where the device is, got nothing\n"
            "a.toml:5:12: key 'tracker.sensor': expected another, got \"0A\": measure it\n"
            "a.toml: key 'camera.device': expected a camera");
  EXPECT_EQ(told_in("nowhere/a.toml", {{"tracker.port", "expected\nno line"}}).message,
            "nowhere/a.toml: key 'tracker.port': expected no line");
}

}  // namespace
}  // namespace perimap
