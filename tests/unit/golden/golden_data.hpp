// Reading the golden vectors of tests/data/golden and comparing with them.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/estimation/iterated_update.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"
#include "core/periodic/basis.hpp"

namespace perimap::golden {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

inline constexpr double kTolerance = 1e-9;
inline constexpr int kUntilConverged = 200;

inline json load(const std::string& name) {
  const std::string path = std::string(PERIMAP_TEST_DATA) + "/golden/" + name;
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  return json::parse(file);
}

inline VectorXd vector_of(const json& values) {
  const auto v = values.get<std::vector<double>>();
  return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

inline MatrixXd matrix_of(const json& rows) {
  MatrixXd M(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(rows.front().size()));
  for (Eigen::Index i = 0; i < M.rows(); ++i) M.row(i) = vector_of(rows[static_cast<std::size_t>(i)]).transpose();
  return M;
}

inline Matrix3d rotation_of(const json& nine) {
  const VectorXd v = vector_of(nine);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

inline Pose pose_of(const Matrix3d& R, const Vector3d& c) { return {R, -(R * c)}; }

inline PixelModel pixel_model(double f = 700.0, double cx = 640.0, double cy = 360.0) {
  return {CameraModel{.width = 1280, .height = 720, .fx = f, .fy = f, .cx = cx, .cy = cy}};
}

// Largest difference relative to the largest expected magnitude.
inline testing::AssertionResult matches(const MatrixXd& got, const MatrixXd& expected, double tolerance = kTolerance) {
  if (got.rows() != expected.rows() || got.cols() != expected.cols()) {
    return testing::AssertionFailure() << "size " << got.rows() << "x" << got.cols();
  }
  const double error = (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
  if (error <= tolerance) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "relative difference " << error;
}

// Calls visit(model, case) with the model that the case names.
template <class Visit>
void with_model(const std::string& name, Visit visit) {
  if (name == "bearing") {
    visit(BearingModel{});
  } else {
    ASSERT_EQ(name, "pixel");
    visit(pixel_model());
  }
}

inline UpdateSettings exact_settings() {
  UpdateSettings settings;
  settings.tolerance = 0.0;
  settings.gate = 1e300;
  return settings;
}

// The one observation of a case of c_update.json.
inline Observation observation_of(const json& c, const BasisLayout& layout) {
  Observation observation;
  observation.z = vector_of(c["z"]);
  observation.R = matrix_of(c["Rm"]);
  observation.b = basis_at(layout, c["phi"].get<double>());
  observation.X_CW = pose_of(matrix_of(c["R"]), vector_of(c["c"]));
  return observation;
}

inline std::vector<Observation> observations_of(const json& run, const BasisLayout& layout) {
  std::vector<Observation> observations(run["z"].size());
  for (std::size_t k = 0; k < observations.size(); ++k) {
    observations[k].z = vector_of(run["z"][k]);
    observations[k].R = matrix_of(run["Rm"]);
    observations[k].b = basis_at(layout, run["phi"][k].get<double>());
    observations[k].X_CW = pose_of(rotation_of(run["R"][k]), vector_of(run["c"][k]));
  }
  return observations;
}

}  // namespace perimap::golden
