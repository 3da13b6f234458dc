#include "core/phase/beat_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace perimap {
namespace {

constexpr double kInRhythm = 0.8;       // of the beats; the others come whenever they like
constexpr double kRefractory_s = 0.18;  // of the ventricles (Pan & Tompkins 1985: 0.2),
constexpr double kRecovered_s = 0.34;   // and until they are excited as at any time
constexpr double kExcluded = -12.0;     // log
constexpr double kUsual_s = 0.8;        // while no cycle is known
constexpr double kUsualSpread = 0.35;
constexpr double kLogRange = 2.0;  // of intervals without rhythm: from 0.37 to 2.7 cycles, evenly in the logarithm
constexpr double kLeastSurvival = 0.03;  // beats may stay away

double normal_tail(double z) noexcept { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

}  // namespace

double RhythmModel::log_density(double rr_s) const noexcept {
  if (rr_s < kRefractory_s) return kExcluded;
  const double excitable = std::min((rr_s - kRefractory_s) / (kRecovered_s - kRefractory_s), 1.0);
  double density = 1.0;
  if (cycle_s > 0.0) {
    const double z = std::log(rr_s / cycle_s) / spread;
    density =
        1.0 - kInRhythm + kInRhythm * std::exp(-0.5 * z * z) / (spread * std::sqrt(2.0 * std::numbers::pi)) * kLogRange;
  }
  return std::log(density) + 2.0 * std::log(std::max(excitable, 1e-3));
}

double RhythmModel::survival(double since_s) const noexcept {
  if (since_s <= 0.0) return 1.0;
  const bool known = cycle_s > 0.0;
  const double x = std::log(since_s / (known ? cycle_s : kUsual_s));
  const double in_rhythm = normal_tail(x / (known ? spread : kUsualSpread));
  const double free = std::clamp(0.5 - x / kLogRange, 0.0, 1.0);
  return std::max(kInRhythm * in_rhythm + (1.0 - kInRhythm) * free, kLeastSurvival);
}

}  // namespace perimap
