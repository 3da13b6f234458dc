// The dense baselines compiled for the machine that builds them, with every optimisation, as the bank's kernels are.
//
// A library of its own, which holds its own copy of the estimator's code: types of Eigen differ in alignment between
// instruction sets, so that only numbers may pass, and no inline function may be shared.
#pragma once

#include <memory>

namespace perimap::bench {

// One observation by its numbers, matrices by columns.
struct PlainObservation {
  const double* z;     // [2]
  const double* R;     // [2][2]
  const double* b;     // [n]
  const double* R_CW;  // [3][3]
  const double* t_CW;  // [3]
};

class __attribute__((visibility("default"))) NativeFeature {
 public:
  // A pinhole camera without distortion, as the scene's. x [3 n], P [3 n][3 n].
  NativeFeature(int n, const double* x, const double* P, double f_px, double cx, double cy);
  ~NativeFeature();
  NativeFeature(const NativeFeature&) = delete;
  NativeFeature& operator=(const NativeFeature&) = delete;

  // As the functions of dense_baselines.hpp.
  void paper_update(const PlainObservation& observation, int iterations);
  void kalman_update(const PlainObservation& observation, int iterations);
  [[nodiscard]] const double* x() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace perimap::bench
