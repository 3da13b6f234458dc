#include "drivers/standins/simulator/stretches.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

const SimulationSettings::Stretch* stretch_of(const std::vector<SimulationSettings::Stretch>& stretches,
                                              Duration since) noexcept {
  const auto found = std::find_if(stretches.begin(), stretches.end(), [&](const auto& stretch) {
    return since >= stretch.begin && since < stretch.begin + stretch.length;
  });
  return found == stretches.end() ? nullptr : &*found;
}

std::size_t looped(const std::vector<SimulationSettings::Stretch>& loops, std::size_t number, double rate_hz,
                   Duration period) noexcept {
  const auto* loop = stretch_of(loops, from_seconds(static_cast<double>(number) / rate_hz));
  if (loop == nullptr) return number;
  const auto begun = static_cast<std::size_t>(std::ceil(to_seconds(loop->begin) * rate_hz));
  const auto length = std::min(begun, static_cast<std::size_t>(std::lround(to_seconds(period) * rate_hz)));
  if (length == 0 || number < begun) return number;
  return begun - length + (number - begun) % length;
}

}  // namespace perimap
