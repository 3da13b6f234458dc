// The code against the golden vectors of tests/data/golden, produced by an independent implementation.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "core/estimation/batch_start.hpp"
#include "core/estimation/iterated_update.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/periodic/basis.hpp"
#include "core/periodic/periodic_motion.hpp"
#include "golden_data.hpp"

namespace perimap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

using golden::exact_settings;
using golden::kTolerance;
using golden::kUntilConverged;
using golden::load;
using golden::matches;
using golden::matrix_of;
using golden::observation_of;
using golden::observations_of;
using golden::pixel_model;
using golden::pose_of;
using golden::vector_of;
using golden::with_model;

TEST(Golden, PositionsEqualTheInverseFft) {
  for (const json& c : load("a_reconstruct.json")) {
    const BasisLayout layout{.cardiac_harmonics = c["H"].get<int>()};
    const int N = c["N"].get<int>();
    const MatrixXd X = matrix_of(c["X"]);
    StateVector x(layout.state_size());
    for (int axis = 0; axis < 3; ++axis) x.segment(axis * layout.size(), layout.size()) = X.row(axis).transpose();

    const VectorXd x_paper = vector_of(c["x_paper_order"]);
    EXPECT_TRUE(matches(to_paper_order(x), x_paper));
    EXPECT_TRUE(matches(from_paper_order(x_paper), x));

    const auto n = c["n"].get<std::vector<int>>();
    const MatrixXd sampled = matrix_of(c["position"]);
    MatrixXd got(sampled.rows(), 3);
    for (std::size_t i = 0; i < n.size(); ++i) {
      got.row(static_cast<int>(i)) = position_of(x, basis_at(layout, 2.0 * std::numbers::pi * n[i] / N)).transpose();
    }
    EXPECT_TRUE(matches(got, sampled));

    const VectorXd phi = vector_of(c["phi"]);
    got.resize(phi.size(), 3);
    for (Eigen::Index i = 0; i < phi.size(); ++i) {
      got.row(i) = position_of(x, basis_at(layout, phi(i))).transpose();
    }
    EXPECT_TRUE(matches(got, matrix_of(c["position_at_phi"])));

    // The forward transform of our samples over a whole cycle gives the bins back.
    MatrixXd bins(2, N);
    for (int k = 0; k < N; ++k) {
      std::complex<double> bin = 0.0;
      for (int i = 0; i < N; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / N;
        bin += position_of(x, basis_at(layout, angle)).x() * std::polar(1.0, -k * angle);
      }
      bins.col(k) << bin.real(), bin.imag();
    }
    MatrixXd expected(2, N);
    expected << vector_of(c["fft_x_re"]).transpose(), vector_of(c["fft_x_im"]).transpose();
    EXPECT_TRUE(matches(bins, expected));
  }
}

template <class Model>
void expect_measurement(const Model& model, const json& c) {
  const Pose X_CW = pose_of(matrix_of(c["R"]), vector_of(c["c"]));
  const Vector3d p = vector_of(c["p"]);
  Vector2d z;
  MeasurementJacobians J;
  ASSERT_EQ(measure(model, X_CW, p, z, &J), ProjectionStatus::kOk);
  EXPECT_TRUE(matches(z, vector_of(c["z"])));
  EXPECT_TRUE(matches(J.dz_dp, matrix_of(c["dz_dp"])));
  EXPECT_TRUE(matches(J.dz_dc, matrix_of(c["dz_dc"])));
  EXPECT_TRUE(matches(J.dz_dtheta, matrix_of(c["dz_dtheta_left"])));

  const BasisLayout layout{.cardiac_harmonics = c["H"].get<int>()};
  const Basis b = basis_at(layout, c["phi"].get<double>());
  const int n = layout.size();
  MatrixXd H(2, 3 * n);
  MatrixXd H_paper(2, 3 * n);
  for (int i = 0; i < 3 * n; ++i) {
    H.col(i) = J.dz_dp.col(i / n) * b(i % n);
    H_paper.col(paper_index(n, i)) = H.col(i);
  }
  EXPECT_TRUE(matches(H, matrix_of(c["dz_dx_internal_order"])));
  EXPECT_TRUE(matches(H_paper, matrix_of(c["dz_dx_paper_order"])));

  const double sigma_c = c["sig_c_mm"].get<double>();
  const double sigma_theta = c["sig_theta_rad"].get<double>();
  EXPECT_TRUE(matches(pose_noise_covariance(J, sigma_c * sigma_c * Matrix3d::Identity(),
                                            sigma_theta * sigma_theta * Matrix3d::Identity()),
                      matrix_of(c["pose_noise_cov"])));
}

TEST(Golden, MeasurementsAndTheirJacobians) {
  int i = 0;
  for (const json& c : load("b_measure.json")) {
    SCOPED_TRACE("case " + std::to_string(i++));
    if (c["model"] == "bearing") {
      expect_measurement(BearingModel{}, c);
    } else {
      expect_measurement(pixel_model(c["f"].get<double>(), c["cx"].get<double>(), c["cy"].get<double>()), c);
    }
  }
}

TEST(Golden, SingleUpdates) {
  int i = 0;
  for (const json& c : load("c_update.json")) {
    SCOPED_TRACE("case " + std::to_string(i++));
    const BasisLayout layout{.cardiac_harmonics = c["H"].get<int>()};
    const Observation observation = observation_of(c, layout);
    UpdateSettings settings = exact_settings();
    settings.method = UpdateMethod::kGaussNewton;
    settings.step_factor = c["gamma"].get<double>();
    settings.max_iterations = c["iterations"].is_string() ? kUntilConverged : c["iterations"].get<int>();
    for (const bool at_final : {true, false}) {
      settings.covariance = at_final ? CovarianceLinearisation::kFinalIterate : CovarianceLinearisation::kLastStep;
      FeatureEstimate estimate{vector_of(c["x0"]), matrix_of(c["P0"])};
      UpdateOutcome outcome;
      with_model(c["model"].get<std::string>(),
                 [&](const auto& model) { outcome = iterated_update(estimate, observation, model, settings); });
      ASSERT_TRUE(outcome.accepted);
      EXPECT_TRUE(matches(estimate.x, vector_of(c["x"])));
      EXPECT_TRUE(matches(estimate.P, matrix_of(c[at_final ? "P_at_final_x" : "P_at_last_linearisation"])));
      // The cost has an error of about 1e-16 times the squared pixel or angle over its variance.
      EXPECT_NEAR(outcome.map_cost, c["map_cost"].get<double>(), 1e-9 * (1.0 + c["map_cost"].get<double>()));
    }
  }
}

void expect_estimate(const FeatureEstimate& estimate, const json& expected, double tolerance = kTolerance) {
  EXPECT_TRUE(matches(estimate.x, vector_of(expected["x"]), tolerance));
  EXPECT_TRUE(matches(estimate.P, matrix_of(expected["P"]), tolerance));
}

class GoldenRun : public testing::TestWithParam<const char*> {
 protected:
  json run = load(GetParam());
  BasisLayout layout{.cardiac_harmonics = run["H"].get<int>()};
  std::vector<Observation> observations = observations_of(run, layout);
};

TEST_P(GoldenRun, UpdatesFromOneRay) {
  for (const json& expected : run["runs"]) {
    SCOPED_TRACE(expected["iterations"].dump());
    UpdateSettings settings = exact_settings();
    const bool lm = expected["iterations"] == "lm converged";
    settings.method = lm ? UpdateMethod::kLevenbergMarquardt : UpdateMethod::kGaussNewton;
    // Gauss-Newton runs into a cycle of 19 steps at the 21st update of the bearing run, so the limit is part of it.
    settings.max_iterations = expected["iterations"].is_string() ? kUntilConverged : expected["iterations"].get<int>();
    // At the same update the minimum that Levenberg-Marquardt descends to is the camera's centre, where a bearing is
    // undefined and its Jacobian infinite. How near a program comes there before rounding stops it is its own affair,
    // and later updates carry that on: the next vector after it is met loosely, and the rest from that vector itself.
    const bool singular = lm && run["model"] == "bearing";
    constexpr std::size_t kSingularUpdate = 21;
    bool past_singular = false;
    FeatureEstimate estimate;
    estimate.x = vector_of(run["x0"]);
    estimate.P = MatrixXd(vector_of(run["P0_diag"]).asDiagonal());
    int checked = 0;
    with_model(run["model"].get<std::string>(), [&](const auto& model) {
      for (std::size_t k = 0; k < observations.size(); ++k) {
        ASSERT_TRUE(iterated_update(estimate, observations[k], model, settings).accepted);
        const std::string after = std::to_string(k + 1);
        if (!expected["after"].contains(after)) continue;
        SCOPED_TRACE("after " + after);
        const json& vector = expected["after"][after];
        const bool loose = singular && !past_singular && k >= kSingularUpdate;
        expect_estimate(estimate, vector, loose ? 1e-5 : kTolerance);
        if (loose) estimate = {vector_of(vector["x"]), MatrixXd(matrix_of(vector["P"]))};
        past_singular = past_singular || loose;
        ++checked;
      }
    });
    EXPECT_EQ(checked, 5);
  }
}

TEST_P(GoldenRun, DelayedStartAndWhatFollows) {
  const json& expected = run["delayed_init_30"];
  const Prior prior{.dc_mm = 40.0, .cardiac_mm = 4.0, .decay = 1.0};
  BatchSettings settings;
  settings.prior_depth_mm = 95.0;
  settings.robust = false;
  settings.tolerance = 1e-19;
  with_model(run["model"].get<std::string>(), [&](const auto& model) {
    const BatchOutcome start = batch_start(std::span(observations).first(30), model, layout, prior, settings);
    ASSERT_TRUE(start.ok());
    expect_estimate(start.estimate, expected);
    EXPECT_NEAR(start.map_cost, expected["map_cost"].get<double>(), 1e-9 * start.map_cost);

    FeatureEstimate estimate = start.estimate;
    UpdateSettings update = exact_settings();
    update.max_iterations = 40;
    for (std::size_t k = 30; k < observations.size(); ++k) {
      ASSERT_TRUE(iterated_update(estimate, observations[k], model, update).accepted);
    }
    expect_estimate(estimate, expected["after_300"]);
  });
}

INSTANTIATE_TEST_SUITE_P(BothModels, GoldenRun, testing::Values("d_run_bearing.json", "d_run_pixel.json"),
                         [](const auto& parameter) {
                           return std::string(parameter.param).find("pixel") != std::string::npos ? "Pixel" : "Bearing";
                         });

}  // namespace
}  // namespace perimap
