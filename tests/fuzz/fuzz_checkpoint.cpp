// Any bytes as what an earlier run left: an error, or a checkpoint whose figures are sound.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/checkpoint/checkpoint_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  static_cast<void>(parse_checkpoint(bytes));
  // Without the CRC, which would keep the fuzzer out.
  const Expected<Checkpoint> checkpoint = parse_checkpoint_body(bytes);
  if (!checkpoint) return 0;
  for (const FeatureMemory& feature : checkpoint->memory.features) {
    if (!feature.estimate.x.allFinite() || !feature.estimate.P.allFinite()) std::abort();
    for (std::size_t l = 0; l < feature.patch.levels.size(); ++l) {
      const PatchTemplate::Level& level = feature.patch.levels[l];
      if (level.usable && level.side != PatchTemplate::kSide[l]) std::abort();
    }
  }
  return 0;
}
