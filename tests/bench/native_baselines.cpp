#include "native_baselines.hpp"

#include "dense_baselines.hpp"

namespace perimap::bench {

struct NativeFeature::State {
  int n = 0;
  PixelModel model;
  FeatureEstimate estimate;

  [[nodiscard]] Observation observation(const PlainObservation& plain) const {
    Observation o;
    o.z = Eigen::Map<const Vector2d>(plain.z);
    o.R = Eigen::Map<const Matrix2d>(plain.R);
    o.b = Eigen::Map<const Eigen::VectorXd>(plain.b, n);
    o.X_CW.R = Eigen::Map<const Matrix3d>(plain.R_CW);
    o.X_CW.t = Eigen::Map<const Vector3d>(plain.t_CW);
    return o;
  }
};

NativeFeature::NativeFeature(int n, const double* x, const double* P, double f_px, double cx, double cy)
    : state_(std::make_unique<State>()) {
  state_->n = n;
  state_->model.camera = CameraModel{.width = 1280, .height = 720, .fx = f_px, .fy = f_px, .cx = cx, .cy = cy};
  state_->estimate.x = Eigen::Map<const Eigen::VectorXd>(x, 3 * n);
  state_->estimate.P = Eigen::Map<const Eigen::MatrixXd>(P, 3 * n, 3 * n);
}

NativeFeature::~NativeFeature() = default;

void NativeFeature::paper_update(const PlainObservation& observation, int iterations) {
  bench::paper_update(state_->estimate, state_->observation(observation), state_->model, iterations);
}

void NativeFeature::kalman_update(const PlainObservation& observation, int iterations) {
  bench::kalman_update(state_->estimate, state_->observation(observation), state_->model, iterations);
}

const double* NativeFeature::x() const { return state_->estimate.x.data(); }

}  // namespace perimap::bench
