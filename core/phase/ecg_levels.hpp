// The levels of an ECG that go by the signal alone, not by what is taken for a beat: its quiet part, its largest
// complexes, its roughness. What goes by them cannot be locked on to the wrong wave.
#pragma once

#include <array>
#include <cstdint>

#include "core/phase/ecg_filter.hpp"
#include "core/phase/r_peak_detector_settings.hpp"
#include "core/phase/recent_values.hpp"

namespace perimap {

class EcgLevels {
 public:
  explicit EcgLevels(const EcgLevelSettings& settings) noexcept : settings_(settings) {}

  // The filter has a new sample. `beat_slope`: of the usual beat, 0 where none is known. `burst`: among disturbances,
  // whose complexes are no measure.
  void follow(const EcgFilter& filter, double beat_slope, bool burst) noexcept;
  void restart() noexcept;  // the line was broken off
  void forget() noexcept;
  // But for that of the last window: no complex of late is as large as those before. `keep`: those were beats, which
  // may come again as they were.
  void forget_top(bool keep) noexcept;
  void recall_top() noexcept;  // what was kept, once

  [[nodiscard]] double quiet() const noexcept { return quiet_level_; }  // energy
  // The lowest quiet level of late: of noise that is always there, and not in a burst alone.
  [[nodiscard]] double noise() const noexcept { return noise_level_; }
  // The same as root mean square of the slope: 1.25 times the mean magnitude where it is normal.
  [[nodiscard]] double slope_noise_rms() const noexcept { return 1.25 * noise_level_; }
  [[nodiscard]] double usual_roughness() const noexcept { return rough_level_; }        // mV, likewise
  [[nodiscard]] double top_energy() const noexcept { return top(energies_, energy_); }  // of the largest complexes
  [[nodiscard]] double top_sharpness() const noexcept { return top(sharpnesses_, sharpness_); }
  // Nothing can be seen, for the line is too rough; of the last such stretch, and its end.
  [[nodiscard]] Instant rough_until() const noexcept { return rough_until_; }
  [[nodiscard]] bool rough(Instant t) const noexcept { return t > rough_since_ && t < rough_until_; }
  // The line has been several times as rough as usual for longer than a QRS complex, however small that is beside it.
  [[nodiscard]] bool rougher_than_usual() const noexcept { return rougher_; }

 private:
  static constexpr int kQuietHistory = 128;  // energies, one each 20 ms
  static constexpr int kWindows = 8;

  void follow_quiet(const EcgFilter& filter) noexcept;
  void follow_noise() noexcept;
  void follow_top(const EcgFilter& filter, bool burst) noexcept;
  void follow_roughness(const EcgFilter& filter, double beat_slope) noexcept;
  [[nodiscard]] static double top(const RecentValues<kWindows>& windows, double current) noexcept;

  EcgLevelSettings settings_;
  std::array<double, kQuietHistory> quiet_{};
  std::int64_t quiet_count_ = 0;
  double quiet_level_ = 0.0;
  double noise_level_ = 0.0;
  bool noise_known_ = false;  // of a whole history
  RecentValues<kWindows> energies_;
  RecentValues<kWindows> sharpnesses_;
  RecentValues<kWindows> kept_energies_;  // of before a silence
  RecentValues<kWindows> kept_sharpnesses_;
  double energy_ = 0.0;  // largest of the current window
  double sharpness_ = 0.0;
  Instant window_began_;
  bool in_window_ = false;
  double rough_level_ = 0.0;  // the lowest of late
  bool rougher_ = false;
  Instant usual_at_;   // the last instant of the usual roughness
  Instant smooth_at_;  // the last instant that was not rough
  Instant rough_since_;
  Instant rough_until_;
};

}  // namespace perimap
