// Features of a generated clip of beating tissue, while something happens to the picture.
#include <gtest/gtest.h>

#include <string>

#include "daemon/evaluation/track_judge/disturbance_trial.hpp"
#include "tests/simulated/wet_tissue.hpp"

namespace perimap {
namespace {

constexpr int kFeatures = 60;
constexpr std::size_t kFrames = 220;

class Disturbed : public ::testing::TestWithParam<Disturbance> {};

TEST_P(Disturbed, FeaturesAreFoundAgainWithinASecondOfItsReturn) {
  WetTissueSettings settings;
  settings.width = 256;
  settings.height = 256;
  WetTissue tissue(settings);
  const auto frame_at = [&tissue](std::size_t step) {
    const WetTissue::Frame frame = tissue.frame(static_cast<int>(step));
    return VideoFrame{step, frame.colour, frame.grey};
  };
  const auto figures = try_disturbance(frame_at, kFrames, settings.frames_per_s, kFeatures, GetParam());
  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_GE(figures->features, std::size_t{kFeatures} / 3);
  EXPECT_GE(static_cast<double>(figures->found), 0.9 * static_cast<double>(figures->features))
      << figures->found << " of " << figures->features;
  EXPECT_LE(figures->wrong, 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, Disturbed, ::testing::ValuesIn(kDisturbances),
                         [](const auto& of) { return std::string(name_of(of.param)); });

TEST(DisturbedClip, ThatIsTooShortIsToldWithWhatItNeeds) {
  const auto figures = try_disturbance([](std::size_t) { return VideoFrame{}; }, 20, 25, kFeatures, Disturbance::kFog);
  ASSERT_FALSE(figures);
  EXPECT_EQ(figures.error().message, "20 frames are too few for fog: 115 are needed");
}

}  // namespace
}  // namespace perimap
