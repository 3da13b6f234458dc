// Runs the methods side by side over the features of many trials, and gathers their figures.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "daemon/evaluation/experiment/method.hpp"

namespace perimap {

// A feature is lost when its path error exceeds this.
inline constexpr double kLostError_mm = 2.0;

// One line of an experiment's table. Errors are RMS over a cycle; a feature without an estimate has an infinite one.
struct MethodRow {
  std::string method;
  int features = 0;
  double median_mm = 0.0;
  double p95_mm = 0.0;
  double worst_mm = 0.0;
  double share_above_2_mm = 0.0;
  double mean_nees = 0.0;      // of the position, divided by 3; NaN for the bound
  double us_per_update = 0.0;  // processor time, mean over all sightings, starts included; NaN for the bound
};

class Comparison {
 public:
  // Figures over time are gathered every `interval_s`. `first_depth_mm`: as in MethodSetting.
  Comparison(std::vector<MethodKind> kinds, const BasisLayout& layout, const Prior& prior, double first_depth_mm,
             double interval_s, const MethodOptions& options = {});

  // Runs every method on every feature of the scene. Features seen fewer than `buffered` times are left out.
  void add(const Scene& scene);

  [[nodiscard]] std::vector<MethodRow> rows() const;

  struct CurvePoint {
    double time_s = 0.0;
    double median_mm = 0.0;  // over the features that have an estimate
  };
  // Of the filters and the bound; empty for the batch, which is solved at the end alone.
  [[nodiscard]] std::vector<CurvePoint> curve(const std::string& method) const;

  // Mean over features of |innovation of the static EKF| - |innovation of the method|, by the number of the sighting.
  struct InnovationPoint {
    double time_s = 0.0;
    double difference = 0.0;  // in units of z
  };
  [[nodiscard]] std::vector<InnovationPoint> innovation_difference(MethodKind kind) const;

  static constexpr const char* kBound = "Cramer-Rao bound";

 private:
  struct Figures {
    std::vector<double> errors_mm;
    std::vector<double> nees;
    double taken_ns = 0.0;
    double sightings = 0.0;
    std::map<int, std::vector<double>> errors_over_time_mm;  // by interval
    std::map<int, std::pair<double, int>> differences;       // by sighting: sum and count
  };
  void add_feature(const Scene& scene, const SceneFeature& feature);
  void add_bound(const Scene& scene, const SceneFeature& feature);

  std::vector<MethodKind> kinds_;
  MethodSetting setting_;
  double interval_s_;
  double frame_s_ = 0.0;
  MethodOptions options_;
  std::map<std::string, Figures> figures_;
};

}  // namespace perimap
