// The phases that one sweep over a bank serves, the same for all features of a frame.
#pragma once

#include <array>

#include "core/periodic/basis.hpp"

namespace perimap {

inline constexpr int kMaxLearntPhases = 4;
inline constexpr int kMaxSweepPhases = 12;  // learnt ones included

template <class Real>
struct SweepPhase {
  std::array<Real, kMaxBasis> b{};       // basis
  std::array<Real, kMaxBasis> b_rate{};  // db/dphi, 1/rad
  Real rate_rad_per_s = 0;               // dphi/dt
  Real deviation_s = 0;                  // standard deviation of the phase, as a time

  void set(const Basis& at_phase, const Basis& rate, double phase_rate_rad_per_s, double phase_deviation_s) noexcept {
    for (Eigen::Index i = 0; i < at_phase.size(); ++i) {
      b[static_cast<std::size_t>(i)] = static_cast<Real>(at_phase(i));
      b_rate[static_cast<std::size_t>(i)] = i < rate.size() ? static_cast<Real>(rate(i)) : Real(0);
    }
    rate_rad_per_s = static_cast<Real>(phase_rate_rad_per_s);
    deviation_s = static_cast<Real>(phase_deviation_s);
  }

  // The same phase in this precision.
  template <class Other>
  void assign(const SweepPhase<Other>& other) noexcept {
    for (std::size_t i = 0; i < b.size(); ++i) {
      b[i] = static_cast<Real>(other.b[i]);
      b_rate[i] = static_cast<Real>(other.b_rate[i]);
    }
    rate_rad_per_s = static_cast<Real>(other.rate_rad_per_s);
    deviation_s = static_cast<Real>(other.deviation_s);
  }
};

// Phases to learn at come first: for these a sweep forms M = P B^T (d x 3), which the update needs; for those that are
// only predicted at it forms S = B P B^T (3x3) alone, at half the cost.
template <class Real>
class SweepPhases {
 public:
  void clear() noexcept { count_ = learnt_ = 0; }

  // Returns the phase's number, or -1 when there is no room, or a predicted one was added before.
  int add_learnt(const Basis& b, const Basis& b_rate, double rate_rad_per_s = 0.0, double deviation_s = 0.0) noexcept {
    if (learnt_ == kMaxLearntPhases || learnt_ < count_) return -1;
    ++learnt_;
    return add(b, b_rate, rate_rad_per_s, deviation_s);
  }
  int add_predicted(const Basis& b, const Basis& b_rate, double rate_rad_per_s = 0.0,
                    double deviation_s = 0.0) noexcept {
    return count_ == kMaxSweepPhases ? -1 : add(b, b_rate, rate_rad_per_s, deviation_s);
  }

  // The same phases in this precision.
  template <class Other>
  void assign(const SweepPhases<Other>& other) noexcept {
    for (int k = 0; k < other.count(); ++k) phases_[static_cast<std::size_t>(k)].assign(other[k]);
    count_ = other.count();
    learnt_ = other.learnt();
  }

  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] int learnt() const noexcept { return learnt_; }
  [[nodiscard]] const SweepPhase<Real>& operator[](int k) const noexcept {
    return phases_[static_cast<std::size_t>(k)];
  }

 private:
  int add(const Basis& b, const Basis& b_rate, double rate_rad_per_s, double deviation_s) noexcept {
    phases_[static_cast<std::size_t>(count_)].set(b, b_rate, rate_rad_per_s, deviation_s);
    return count_++;
  }

  std::array<SweepPhase<Real>, kMaxSweepPhases> phases_{};
  int count_ = 0;
  int learnt_ = 0;
};

}  // namespace perimap
