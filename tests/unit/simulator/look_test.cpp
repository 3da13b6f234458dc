// The looks of the simulated heart: the rendered one stays what it was to the byte; that of tissue has the statistics
// of footage.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/standins/simulator/simulation.hpp"
#include "tests/simulated/picture_statistics.hpp"

namespace perimap {
namespace {

struct Shown {
  Simulation simulation;
  RenderWorkspace workspace;
  std::vector<std::uint8_t> picture;

  explicit Shown(const SimulationSettings& settings, const ParallelFor& parallel_for = serial_for)
      : simulation(Simulation::create(settings, parallel_for).value()),
        picture(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height)) {}

  const std::vector<std::uint8_t>& frame(std::size_t index) {
    simulation.render(index, workspace, picture);
    return picture;
  }
};

SimulationSettings small(Look look, std::uint64_t seed = 1) {
  SimulationSettings settings;
  settings.look = look;
  settings.seed = seed;
  settings.width = 128;
  settings.height = 96;
  settings.duration = std::chrono::seconds(4);
  return settings;
}

// FNV-1a (Fowler, Noll & Vo).
std::uint64_t hash_of(const std::vector<std::uint8_t>& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001b3U;
  return hash;
}

// Figures of many recordings and tests were made with it.
TEST(Look, RenderedIsWhatItWasToTheByte) {
  Shown shown(small(Look::kRendered));
  EXPECT_EQ(hash_of(shown.frame(0)), 0x01cb32132c948811U);
  EXPECT_EQ(hash_of(shown.frame(100)), 0x0016e6596229c25cU);
}

TEST(Look, TissueIsAFunctionOfSeedAndTimeAlone) {
  Shown one(small(Look::kTissue)), other(small(Look::kTissue)), of_another_seed(small(Look::kTissue, 2));
  other.frame(3);
  const std::vector<std::uint8_t> picture = one.frame(40);
  EXPECT_EQ(picture, other.frame(40));
  EXPECT_NE(picture, of_another_seed.frame(40));
  Shown rendered(small(Look::kRendered));
  EXPECT_NE(picture, rendered.frame(40));
}

// What was measured on footage by tests/bench/look_bench (docs/evidence/looks.md): from the least to the largest of the
// clips of 256x256 and 360x288 px.
struct Range {
  double PictureStatistics::*value;
  double least, largest;
};
constexpr Range kFootage[] = {
    {&PictureStatistics::lit_grey, 66, 113},
    {&PictureStatistics::spread, 1.0, 1.52},
    {&PictureStatistics::noise, 0.72, 2.32},
    {&PictureStatistics::noise_dim, 0.56, 2.19},
    {&PictureStatistics::noise_bright, 0.97, 5.18},
    {&PictureStatistics::gradient, 6.21, 9.19},
    {&PictureStatistics::fine_over_coarse, 1.68, 2.1},
    {&PictureStatistics::blocks, 0.96, 1.05},
    {&PictureStatistics::corner_weak, 1.93, 12.94},
    {&PictureStatistics::corner_middle, 7.0, 28.5},
    {&PictureStatistics::corner_strong, 18.2, 52.7},
    {&PictureStatistics::highlights_percent, 0.12, 0.49},
    {&PictureStatistics::highlight_permille, 0.06, 1.11},
    {&PictureStatistics::highlights_changed, 0.43, 0.9},
    {&PictureStatistics::highlight_speed, 3.9, 17.5},
    {&PictureStatistics::gain_percent, 12.6, 32.7},
    {&PictureStatistics::bias_grey, 2.7, 12.5},
    {&PictureStatistics::kept_correlation, 0.697, 0.917},
    {&PictureStatistics::kept_correlation_tenth, 0.328, 0.715},
    {&PictureStatistics::followed, 0.53, 0.98},
};

TEST(Look, TissueHasTheStatisticsOfFootage) {
  SimulationSettings settings = small(Look::kTissue, 59398);
  settings.width = 320;
  settings.height = 240;
  Shown shown(settings);
  PictureWatch watch(settings.frames_per_s);
  constexpr std::size_t kFrames = 24;
  for (std::size_t k = 0; k < kFrames; ++k) {
    watch.look_at({shown.frame(k).data(), settings.width, settings.height, settings.width});
  }
  // Seeds differ: with this one the picture is sharper than any clip by a hundredth.
  constexpr double kSlack = 0.03;
  const PictureStatistics statistics = watch.statistics();
  for (const NamedStatistic& named : named_statistics()) {
    for (const Range& range : kFootage) {
      if (range.value != named.value) continue;
      EXPECT_GE(statistics.*range.value, (1 - kSlack) * range.least) << named.name;
      EXPECT_LE(statistics.*range.value, (1 + kSlack) * range.largest) << named.name;
    }
  }
}

}  // namespace
}  // namespace perimap
