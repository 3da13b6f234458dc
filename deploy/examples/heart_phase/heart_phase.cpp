// heart_phase RATE_HZ < ECG: reads an ECG, one sample in mV a line. Writes for each sample its time (s), the phase of
// the heart (rad, 0 at the R peak), its standard deviation (ms), and where a point is (mm) that moves 3 mm up and down
// with it.
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "core/periodic/periodic_motion.hpp"
#include "core/phase/beat_finder.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

int main(int argc, char** argv) {
  const double rate_hz = argc == 2 ? std::atof(argv[1]) : 0.0;
  if (!(rate_hz >= 100.0 && rate_hz <= 1000.0)) {
    std::fprintf(stderr, "heart_phase RATE_HZ < ECG: a rate from 100 to 1000 Hz is needed\n");
    return 2;
  }
  perimap::BeatFinder beats;
  perimap::CardiacClockTracker tracker{perimap::CardiacClockSettings{}};

  // The motion: mean and first harmonic of x, y and z, as `perimapd` learns and publishes them (with more harmonics).
  const perimap::BasisLayout layout{.cardiac_harmonics = 1};
  perimap::StateVector motion(layout.state_size());
  motion << 0.0, 0.0, 0.0, /* y */ 0.0, 0.0, 0.0, /* z */ 80.0, 3.0, 0.0;

  float mV = 0.0F;
  for (long sample = 0; std::cin >> mV; ++sample) {
    const perimap::Instant t = perimap::Instant{} + perimap::from_seconds(static_cast<double>(sample) / rate_hz);
    if (const auto r_peak = beats.push(t, mV)) tracker.on_r_peak(*r_peak);
    if (beats.take_interruption()) tracker.interrupt();
    if (beats.signal() == perimap::EcgSignal::kFlat) continue;  // no electrode: nothing is heard
    tracker.heard(t);

    const perimap::PhaseEstimate now = tracker.clock().as_of(t).at(t);
    if (!perimap::usable(now.state)) continue;  // three beats in a row have to be seen first
    const Eigen::Vector3d p = perimap::position_of(motion, perimap::basis_at(layout, now.phase_rad));
    std::printf("%.4f %.4f %.1f %.3f %.3f %.3f\n", perimap::to_seconds(t - perimap::Instant{}), now.phase_rad,
                now.deviation_s * 1e3, p.x(), p.y(), p.z());
  }
  return 0;
}
