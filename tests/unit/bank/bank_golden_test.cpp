// The bank against the golden vectors, on every instruction set.
#include "bank_on_target.hpp"
#include "golden_data.hpp"

namespace perimap {
namespace {

using golden::load;
using golden::matches;
using golden::vector_of;
using nlohmann::json;

class BankGolden : public test::OnEveryTarget {};
INSTANTIATE_TEST_SUITE_P(Simd, BankGolden, testing::ValuesIn(simd_targets()), test::target_name);

TEST_P(BankGolden, SingleUpdates) {
  int i = 0;
  for (const json& c : load("c_update.json")) {
    SCOPED_TRACE("case " + std::to_string(i));
    const BasisLayout layout{.cardiac_harmonics = c["H"].get<int>()};
    const Observation observation = golden::observation_of(c, layout);
    UpdateSettings settings = golden::exact_settings();
    settings.method = UpdateMethod::kGaussNewton;
    settings.step_factor = c["gamma"].get<double>();
    settings.max_iterations = c["iterations"].is_string() ? golden::kUntilConverged : c["iterations"].get<int>();
    for (const bool at_final : {true, false}) {
      settings.covariance = at_final ? CovarianceLinearisation::kFinalIterate : CovarianceLinearisation::kLastStep;
      FeatureBank<double> bank = this->bank(layout, 2 * kLanes);
      const int feature = i++ % bank.features();
      bank.set(feature, {vector_of(c["x0"]), golden::matrix_of(c["P0"])});
      LaneOutcomes<double> outcomes;
      golden::with_model(c["model"].get<std::string>(), [&](const auto& model) {
        outcomes = test::learn(bank, feature, observation, model, settings);
      });
      ASSERT_EQ(outcomes.accepted, 1 << feature % kLanes);
      const FeatureEstimate estimate = test::estimate_of(bank, feature);
      EXPECT_TRUE(matches(estimate.x, vector_of(c["x"])));
      EXPECT_TRUE(matches(estimate.P, golden::matrix_of(c[at_final ? "P_at_final_x" : "P_at_last_linearisation"])));
      EXPECT_NEAR(outcomes.map_cost[feature % kLanes], c["map_cost"].get<double>(),
                  1e-9 * (1.0 + c["map_cost"].get<double>()));
    }
  }
}

void expect_run(FeatureBank<double> bank, const json& run, const json& expected) {
  UpdateSettings settings = golden::exact_settings();
  const bool lm = expected["iterations"] == "lm converged";
  settings.method = lm ? UpdateMethod::kLevenbergMarquardt : UpdateMethod::kGaussNewton;
  settings.max_iterations =
      expected["iterations"].is_string() ? golden::kUntilConverged : expected["iterations"].get<int>();
  // The minimum of one update is the camera's centre, where a bearing is undefined: the next vector is met loosely, the
  // rest from that vector itself; see golden_test.cpp.
  const bool singular = lm && run["model"] == "bearing";
  constexpr std::size_t kSingularUpdate = 21;
  constexpr int kFeature = 3;
  bank.set(kFeature, {vector_of(run["x0"]), Eigen::MatrixXd(vector_of(run["P0_diag"]).asDiagonal())});
  const std::vector<Observation> observations = golden::observations_of(run, bank.layout());
  int checked = 0;
  bool past_singular = false;
  golden::with_model(run["model"].get<std::string>(), [&](const auto& model) {
    for (std::size_t k = 0; k < observations.size(); ++k) {
      ASSERT_NE(test::learn(bank, kFeature, observations[k], model, settings).accepted, 0) << k;
      const std::string after = std::to_string(k + 1);
      if (!expected["after"].contains(after)) continue;
      SCOPED_TRACE("after " + after);
      const bool loose = singular && !past_singular && k >= kSingularUpdate;
      const double tolerance = loose ? 1e-5 : golden::kTolerance;
      const FeatureEstimate vector{vector_of(expected["after"][after]["x"]),
                                   golden::matrix_of(expected["after"][after]["P"])};
      const FeatureEstimate estimate = test::estimate_of(bank, kFeature);
      EXPECT_TRUE(matches(estimate.x, vector.x, tolerance));
      EXPECT_TRUE(matches(estimate.P, vector.P, tolerance));
      if (loose) bank.set(kFeature, vector);
      past_singular = past_singular || loose;
      ++checked;
    }
  });
  EXPECT_EQ(checked, 5);
}

TEST_P(BankGolden, RunsOfThreeHundredUpdates) {
  for (const char* name : {"d_run_bearing.json", "d_run_pixel.json"}) {
    const json run = load(name);
    for (const json& expected : run["runs"]) {
      SCOPED_TRACE(std::string(name) + " " + expected["iterations"].dump());
      expect_run(bank({.cardiac_harmonics = run["H"].get<int>()}, kLanes), run, expected);
    }
  }
}

}  // namespace
}  // namespace perimap
