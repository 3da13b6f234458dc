// What --simulated takes, and what it refuses by its name.
#include "daemon/standins/options/unrecorded_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto parsed = parse_unrecorded("--simulated", text);
  return parsed ? "" : parsed.error().message;
}

TEST(UnrecordedOptions, AreThoseOfPerimapSimulate) {
  const auto parsed = parse_unrecorded(
      "--simulated",
      "--seed 7 --size 320x240 --duration 1200 --procedure draw:7 --tracker-noise 0.5 --tracker-rotation-noise 2 "
      "--field-stop 90 --ecg-off 30:10 --look tissue --threads 3");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->settings.seed, 7U);
  EXPECT_EQ(parsed->settings.width, 320);
  EXPECT_EQ(parsed->settings.height, 240);
  EXPECT_EQ(parsed->settings.duration, std::chrono::seconds(1200));
  EXPECT_FALSE(parsed->settings.procedure.empty());
  EXPECT_TRUE(parsed->settings.held.has_value());
  EXPECT_EQ(parsed->settings.ecg_off.size(), 1U);
  EXPECT_EQ(parsed->noise.position_rms_mm, 0.5);
  EXPECT_NEAR(parsed->noise.rotation_rms_rad, 2.0 * kDegree, 1e-12);
  EXPECT_EQ(parsed->settings.look, Look::kTissue);
  EXPECT_EQ(parsed->threads, 3U);
}

TEST(UnrecordedOptions, WithoutAnyAreTheUsualSession) {
  const auto parsed = parse_unrecorded("--simulated", "");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->settings.width, 640);
  EXPECT_EQ(parsed->settings.duration, std::chrono::seconds(60));
  EXPECT_EQ(parsed->settings.look, Look::kRendered);
  EXPECT_EQ(parsed->noise.position_rms_mm, 1.4);
  EXPECT_GE(parsed->threads, 1U);
}

TEST(UnrecordedOptions, OfFilesAndBenchesAreRefusedByTheirNames) {
  for (const std::string name : {"--force", "--tracker-noises", "--untold", "--write-procedure", "--scene", "--board",
                                 "--board-held", "--truth", "--landmarks"}) {
    EXPECT_THAT(error_of("--seed 1 " + name), StartsWith("--simulated: " + name + ": expected ")) << name;
    EXPECT_THAT(error_of(name + "=x --seed 1"), StartsWith("--simulated: " + name + ": expected ")) << name;
  }
  EXPECT_EQ(error_of("out.mcap --seed 1"), "--simulated: 'out.mcap': is one argument too many");
}

TEST(UnrecordedOptions, WhatIsWrongIsToldAsByPerimapSimulate) {
  EXPECT_THAT(error_of("--sead 1"), HasSubstr("--simulated: --sead: is no option; did you mean '--seed'?"));
  EXPECT_THAT(error_of("--tracker-noise 200"), HasSubstr("--simulated: --tracker-noise:"));
  EXPECT_THAT(error_of("--look wet"), HasSubstr("--simulated: --look:"));
  EXPECT_THAT(error_of("--size 320"), HasSubstr("--simulated: size: expected WIDTHxHEIGHT"));
  EXPECT_THAT(error_of("--turn-to 20"), HasSubstr("--simulated: --turn-to, --zoom-to: expected --field-stop"));
  EXPECT_THAT(error_of("--procedure draw:x"), HasSubstr("--simulated: procedure: expected draw:SEED"));
  EXPECT_THAT(error_of("--procedure nowhere.toml"), HasSubstr("nowhere.toml"));
  EXPECT_THAT(error_of("--procedure 'script.toml"), HasSubstr("--simulated: expected words as in a shell"));
}

}  // namespace
}  // namespace perimap
