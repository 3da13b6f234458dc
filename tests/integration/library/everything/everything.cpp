// Uses a part of core that needs each of the libraries behind it.
#include <cstdint>
#include <vector>

#include "core/bank/feature_bank.hpp"
#include "core/estimation/batch_start.hpp"
#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/vision/feature_detector.hpp"

int main() {
  // Patches of all shades have corners.
  constexpr int kSide = 240;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kSide) * kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      pixels[static_cast<std::size_t>(y * kSide + x)] = static_cast<std::uint8_t>(60 + (x / 9 * 37 + y / 9 * 59) % 140);
  const perimap::GreyImage image{pixels.data(), kSide, kSide, kSide};
  const auto corners = perimap::find_features(image, {}, perimap::detector_settings_for(image, 10), 10);
  if (!corners || corners->size() != 10) return 1;

  perimap::Pipeline pipeline{perimap::PipelineSettings{}};
  return pipeline.slots().empty() ? 2 : 0;
}
