#include "daemon/evaluation/report/recorded_beats.hpp"

#include <array>
#include <memory>
#include <string_view>
#include <variant>

#include "core/phase/beat_finder.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

Expected<std::vector<RPeak>> load_beats(const std::string& recording, ReadMode mode) {
  constexpr std::array<std::string_view, 1> kEcg = {channels::kEcgSamples};
  auto reader = ReplayReader::open(recording, mode, kEcg);
  if (!reader) return tl::unexpected(reader.error());
  const auto finder = std::make_unique<BeatFinder>();
  std::vector<RPeak> beats;
  for (;;) {
    const auto event = reader->next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) return beats;
    const auto& block = std::get<EcgBlock>(**event);
    if (block.lead_off) {
      finder->lead_off(block.first_sample_time);
      continue;
    }
    Instant t = block.first_sample_time;
    for (const float mV : block.samples()) {
      if (auto beat = finder->push(t, mV)) {
        beat->detected_at = block.arrival;
        if (beat->beat_class != BeatClass::kNoise) beats.push_back(*beat);
      }
      t += block.sample_period;
    }
  }
}

}  // namespace perimap
