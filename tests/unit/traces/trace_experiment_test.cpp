#include "daemon/evaluation/traces/trace_experiment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/evaluation/traces/trace_text.hpp"
#include "made_trace.hpp"

namespace perimap::test {
namespace {

TraceExperimentSettings from_to(int from, int to) {
  TraceExperimentSettings settings;
  settings.from = from;
  settings.to = to;
  return settings;
}

TraceExperiment run(const TraceExperimentSettings& settings, const MotionTrace& trace,
                    const std::vector<double>& peaks_s = {}) {
  const auto experiment = run_trace_experiment(settings, trace, peaks_s, [](int) {});
  EXPECT_TRUE(experiment) << experiment.error().message;
  return *experiment;
}

const TraceRow& row(const TraceExperiment& experiment, const std::string& name, double horizon_ms,
                    const std::string& point = "all") {
  return *std::find_if(experiment.rows.begin(), experiment.rows.end(), [&](const TraceRow& r) {
    return r.name == name && r.point == point && std::abs(r.horizon_ms - horizon_ms) < 0.5;
  });
}

TEST(TraceExperiment, OursIsNoWorseThanItsMembersAndItsCovarianceIsRight) {
  const auto made = made_trace(11, 420, 0.9, 0.03, 0.1);
  const TraceExperiment experiment = run(from_to(300, 400), made.trace);
  for (const double ms : {40.0, 120.0, 400.0}) {
    const double ours = row(experiment, "ours", ms).rmse_mm;
    EXPECT_LT(ours, 1.1 * row(experiment, "ar_all", ms).rmse_mm) << ms;
    EXPECT_LT(ours, 1.1 * row(experiment, "periodic", ms).rmse_mm) << ms;
    EXPECT_LT(ours, 0.6 * row(experiment, "hold", ms).rmse_mm) << ms;
    EXPECT_GT(row(experiment, "ours", ms).nees, 0.6) << ms;
    EXPECT_LT(row(experiment, "ours", ms).nees, 1.6) << ms;
    EXPECT_EQ(row(experiment, "ours", ms).starts, 101);
  }
}

TEST(TraceExperiment, RPeaksHelpWhereCyclesDiffer) {
  const auto made = made_trace(12, 420, 0.9, 0.08, 0.1);
  const TraceExperiment without = run(from_to(300, 400), made.trace);
  const TraceExperiment with = run(from_to(300, 400), made.trace, made.r_peaks_s);
  EXPECT_LT(row(with, "ours", 400.0).rmse_mm, row(without, "ours", 400.0).rmse_mm);
}

// Positions after the last sample that any start may see change what is scored, not what is predicted.
TEST(TraceExperiment, NothingIsPredictedFromWhatComesLater) {
  auto made = made_trace(13, 420, 0.9, 0.03, 0.1);
  const TraceExperimentSettings one_start = from_to(300, 300);
  const auto error = [&](const std::string& name) {
    return row(run(one_start, made.trace, made.r_peaks_s), name, 40.0, "A").rmse_mm;
  };
  const std::string names[] = {"hold", "ar_point", "ar_all", "periodic", "ours"};
  double before[5];
  for (int n = 0; n < 5; ++n) before[n] = error(names[n]);
  for (int i = 302; i < 420; ++i) made.trace.positions.row(i).array() += 50.0;
  std::erase_if(made.r_peaks_s, [&](double t) { return t > made.trace.first_s + 300 * 0.04 - 0.1; });
  for (int n = 0; n < 5; ++n) EXPECT_EQ(error(names[n]), before[n]) << names[n];
}

TEST(TraceExperiment, AStretchWithoutEnoughBeforeOrAfterItIsRefused) {
  const auto made = made_trace(14, 420, 0.9, 0.03, 0.1);
  const auto refusal = [&](int from, int to) {
    const auto experiment = run_trace_experiment(from_to(from, to), made.trace, {}, [](int) {});
    return experiment ? std::string() : experiment.error().message;
  };
  EXPECT_EQ(refusal(300, 409), "");
  EXPECT_NE(refusal(300, 410).find("--to"), std::string::npos);
  EXPECT_NE(refusal(300, 299).find("--to"), std::string::npos);
  EXPECT_NE(refusal(90, 300).find("--from"), std::string::npos);
}

TEST(TraceText, EachRowIsInTableJsonAndCsv) {
  const auto made = made_trace(15, 320, 0.9, 0.03, 0.1);
  const TraceExperiment experiment = run(from_to(300, 305), made.trace);
  const auto json = to_json(experiment);
  ASSERT_EQ(json["rows"].size(), 5U * 5U * 3U);
  EXPECT_EQ(json["rows"][0]["name"], "hold");
  EXPECT_EQ(json["rows"][0]["point"], "all");
  EXPECT_EQ(json["rows"][0]["horizon_ms"], 40.0);
  EXPECT_TRUE(json["rows"][0]["nees_over_3"].is_null());
  EXPECT_EQ(json["rows"][0]["starts"], 6);
  const std::string csv = to_csv(experiment);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 75);
  const std::string table = to_table(experiment);
  for (const char* name : {"hold", "ar_point", "ar_all", "periodic", "ours"})
    EXPECT_NE(table.find(name), std::string::npos);
  ASSERT_EQ(to_plots(experiment).size(), 2U);
  EXPECT_EQ(to_plots(experiment)[0].lines.size(), 5U);
}

}  // namespace
}  // namespace perimap::test
