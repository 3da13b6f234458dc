// What might be a QRS complex, and its measures. Measuring is pure: it reads the filter's last samples, and what is
// measured depends on nothing else but the polarity that is asked for.
#pragma once

#include <cstdint>
#include <optional>

#include "core/phase/ecg_filter.hpp"
#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak_detector_settings.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// A local extremum of the line.
struct QrsWave {
  Instant time;  // finer than the sample period
  Duration deviation{0};
  double mV = 0.0;  // from the baseline; 0: there is none
};

struct QrsCandidate {
  Instant time;  // of the local peak, finer than the sample period
  Duration deviation{0};
  QrsShape shape;
  double energy = 0.0;     // mV a 20 ms, mean over 80 ms
  double slope = 0.0;      // mV a 20 ms, largest magnitude
  double sharpness = 0.0;  // mV a (20 ms)^2, mean over 80 ms
  double upward = 0.0;     // largest excursions from the baseline, mV, >= 0
  double downward = 0.0;
  double step = 0.0;   // change of level from before to after, to the excursions
  double rough = 0.0;  // mV, of what is too fast for a QRS complex
  bool points_up = true;
  double peak_mV = 0.0;  // from the baseline
  QrsWave larger;        // the largest wave of the complex beside the peak, where that exceeds it
  QrsWave upright;       // the largest that points as the beats do, where the peak does not; a little before it, too
};

// Which way the beats point: the excursions of those so far.
struct Polarity {
  bool known = false;
  bool up = true;
};

class QrsMeter {
 public:
  QrsMeter(const CandidateSettings& settings, const EcgFilter& filter) noexcept
      : settings_(settings), filter_(filter) {}

  void set_period(Duration period) noexcept;
  [[nodiscard]] int step() const noexcept { return step_; }  // samples between the points of a shape
  [[nodiscard]] int points_after() const noexcept { return points_ - 1 - points_before_; }

  // About a maximum of the energy; the peak is the farthest from the baseline, by the beats' polarity where known.
  [[nodiscard]] QrsCandidate about_crest(std::int64_t energy_peak, Polarity polarity, double noise_mV) const noexcept;
  // Where the shape is known to within some samples; the peak points the way it does there. The shape has no points
  // when another wave of the complex is so much larger that this is not its R peak.
  [[nodiscard]] QrsCandidate about_fit(std::int64_t centre, bool upward, Polarity polarity,
                                       double noise_mV) const noexcept;
  // Of no points while its end is not known.
  [[nodiscard]] QrsShape shape_at(std::int64_t centre) const noexcept;

 private:
  [[nodiscard]] bool begins_before(std::int64_t peak) const noexcept;
  [[nodiscard]] double baseline_about(std::int64_t centre) const noexcept;
  void measure_excursions(std::int64_t centre, QrsCandidate& candidate, std::int64_t& top,
                          std::int64_t& bottom) const noexcept;
  void measure_about(std::int64_t centre, QrsCandidate& candidate) const noexcept;
  void measure_step(std::int64_t peak, QrsCandidate& candidate) const noexcept;
  [[nodiscard]] QrsWave refined(std::int64_t peak, bool upward, double noise_mV) const noexcept;
  void measure_waves(std::int64_t peak, Polarity polarity, double noise_mV, QrsCandidate& candidate) const noexcept;

  const CandidateSettings& settings_;
  const EcgFilter& filter_;
  int step_ = 1;
  int points_before_ = 0;
  int points_ = 0;
};

}  // namespace perimap
