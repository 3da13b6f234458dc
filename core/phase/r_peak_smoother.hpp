// Where the R peaks of completed cycles were, by the ECG and by the phases that the images showed between them.
//
// The map is learnt with the phase of completed cycles, which lies between two R peaks as the ECG has them: noise moves
// each by a millisecond or so, and the heart moves 50 um in one. The phases seen all through the cycle tell where it
// began and ended better. They are those of the map, though, which may be off by some phase of its own: that must be
// estimated too, or the map would only confirm itself, and drift. Over many cycles the R peaks hold it where they are
// on average.
//
// A Kalman filter from cycle to cycle over three times: by how much the R peak at the beginning and that at the end are
// later than the ECG has them, and by how much the map's phase is early. The R peak at the end is the next cycle's at
// the beginning. A phase seen where the length sensitivity is w and the one to the cycle before is p (CyclePhase) is
// early by -(1 - w + p) begin - w end + p begin of the cycle before.
//
// The laws bend, so the phases are taken anew about each estimate. What does not fit then, or lies farther off than the
// R peaks' deviations allow, is not believed, and where the detector doubts an R peak nothing is weighed.
//
// A map that has hardly converged is off by another phase in each part of the cycle, so no R peak is moved before some
// cycles have been weighed.
//
// No heap, no locks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/observed_phase.hpp"

namespace perimap {

class RPeakSmoother {
 public:
  static constexpr std::size_t kFewestObservations = 5;  // in a cycle
  static constexpr std::uint64_t kFirstCycles = 20;      // move nothing yet

  // In order of time; of a map that has converged. More than one in 14 ms tells little more.
  void add(const ObservedPhase& observed) noexcept;
  // A beat has become known: the cycle that it ends is weighed, if it teaches and is in rhythm and no R peak of it is
  // doubtful. `ecg`: as the ECG alone tells it, under the law that the heart is believed to follow.
  void on_beat(const CardiacClock& ecg) noexcept;
  // The clock with the R peaks where they are believed to be.
  [[nodiscard]] CardiacClock moved(const CardiacClock& clock) const noexcept;
  void forget() noexcept { *this = RPeakSmoother(); }

 private:
  static constexpr std::size_t kKept = 256;  // of the slowest heart's cycle, and more
  static constexpr std::size_t kPeaks = CardiacClock::kCompletedCycles + 2;

  enum State : std::uint8_t { kBegin, kEnd, kMap };

  // One phase seen, against the one told, as times: what the filter's state would make of it at 0.
  struct Residual {
    Eigen::Vector3d gradient;
    double value_s = 0.0;
    double deviation_s = 0.0;
  };
  struct Residuals {
    std::array<Residual, kKept> of;
    std::size_t count = 0;
  };

  // Of a cycle's times, in order of State.
  struct Belief {
    Eigen::Vector3d mean_s = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance_s2 = Eigen::Matrix3d::Zero();
  };

  [[nodiscard]] Belief expected(const CardiacCycle& cycle, std::uint64_t end_beat) const noexcept;
  [[nodiscard]] std::optional<Belief> estimate(const CardiacClock& ecg, const CardiacCycle& cycle, double before_s,
                                               const Belief& prior) const noexcept;
  void collect(const CardiacClock& ecg, const CardiacCycle& cycle, const Eigen::Vector3d& about_s, double before_s,
               Residuals& residuals) const noexcept;
  [[nodiscard]] double moved_by_s(std::uint64_t beat) const noexcept;
  void keep(std::uint64_t beat, State state) noexcept;

  std::array<ObservedPhase, kKept> kept_{};
  std::uint64_t kept_count_ = 0;
  Instant last_kept_;
  std::array<MovedRPeak, kPeaks> peaks_{};  // at their beat's number modulo kPeaks
  std::uint64_t cycles_ = 0;                // weighed
  std::uint64_t last_end_ = 0;  // the beat that ended the last one weighed; 0: the next does not go on from it
  Belief last_;                 // of the last one weighed
};

}  // namespace perimap
