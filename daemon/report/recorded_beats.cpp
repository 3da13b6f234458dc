#include "daemon/report/recorded_beats.hpp"

#include <array>
#include <memory>
#include <string_view>
#include <variant>

#include "core/phase/beat_classer.hpp"
#include "core/phase/r_peak_detector.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

Expected<std::vector<RPeak>> load_beats(const std::string& recording, ReadMode mode) {
  constexpr std::array<std::string_view, 1> kEcg = {channels::kEcgSamples};
  auto reader = ReplayReader::open(recording, mode, kEcg);
  if (!reader) return tl::unexpected(reader.error());
  const auto detector = std::make_unique<RPeakDetector>();
  BeatClasser classer;
  std::vector<RPeak> beats;
  for (;;) {
    const auto event = reader->next();
    if (!event) return tl::unexpected(event.error());
    if (!*event) return beats;
    const auto& block = std::get<EcgBlock>(**event);
    if (block.lead_off) {
      detector->lead_off(block.first_sample_time);
      classer.interrupt();
      continue;
    }
    Instant t = block.first_sample_time;
    for (const float mV : block.samples()) {
      if (const auto peak = detector->push(t, mV)) {
        RPeak beat = classer.classify(*peak);
        beat.detected_at = block.arrival;
        if (beat.beat_class != BeatClass::kNoise) beats.push_back(beat);
      }
      t += block.sample_period;
    }
  }
}

}  // namespace perimap
