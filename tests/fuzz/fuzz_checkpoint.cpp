// Any bytes as what an earlier run left: an error, or a checkpoint whose figures are sound.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "core/phase/respiratory_tracker.hpp"
#include "daemon/checkpoint/checkpoint_file.hpp"
#include "daemon/checkpoint/warm_restart.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  static_cast<void>(parse_checkpoint(bytes));
  // Without the CRC, which would keep the fuzzer out.
  const Expected<Checkpoint> checkpoint = parse_checkpoint_body(bytes);
  if (!checkpoint) return 0;
  for (const FeatureMemory& feature : checkpoint->memory.features) {
    if (feature.breathing && !checkpoint->memory.respiration.found) std::abort();
    if (!feature.estimate.x.allFinite() || !feature.estimate.P.allFinite()) std::abort();
    for (std::size_t l = 0; l < feature.patch.levels.size(); ++l) {
      const PatchTemplate::Level& level = feature.patch.levels[l];
      if (level.usable && level.side != PatchTemplate::kSide[l]) std::abort();
    }
  }
  // What goes on from it, in the same boot and in another.
  constexpr Duration kAge = std::chrono::seconds(3);
  const Instant later = checkpoint->saved + kAge;
  for (const std::string& boot : {checkpoint->boot, checkpoint->boot + "x"}) {
    const Now now{boot, later, checkpoint->utc_ns + kAge.count(), checkpoint->suspended};
    const auto memory = usable_memory(*checkpoint, checkpoint->set_up, now, 2 * kAge);
    if (!memory) continue;
    RespirationSettings settings;
    settings.enabled = true;
    RespiratoryTracker respiration(settings);
    respiration.recall(memory->respiration, later);
    const RespiratoryPhase phase = respiration.clock().at(later + kAge);
    if (phase.known && !(std::isfinite(phase.phase_rad) && std::isfinite(phase.rate_rad_per_s))) std::abort();
  }
  return 0;
}
