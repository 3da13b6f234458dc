#include "daemon/runtime/configured_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "drivers/mesh_file/mesh_file.hpp"

namespace perimap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A ball of 40 mm as rings of triangles.
TriangleMesh ball(std::uint32_t rings, double unit) {
  TriangleMesh mesh;
  const std::uint32_t around = 2 * rings;
  for (std::uint32_t i = 0; i <= rings; ++i) {
    const double a = std::numbers::pi * i / rings;
    for (std::uint32_t k = 0; k < around; ++k) {
      const double b = 2.0 * std::numbers::pi * k / around;
      mesh.vertices.emplace_back(40.0 * unit *
                                 Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)));
    }
  }
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t k = 0; k < around; ++k) {
      const std::uint32_t p = i * around + k, q = i * around + (k + 1) % around, r = p + around, s = q + around;
      mesh.triangles.push_back({p, r, q});
      mesh.triangles.push_back({q, r, s});
    }
  }
  return mesh;
}

class ConfiguredModel : public ::testing::Test {
 protected:
  ConfiguredModel() : file_(fs::temp_directory_path() / ("perimap-model-" + std::to_string(::getpid()) + ".ply")) {}
  ~ConfiguredModel() override {
    fs::remove(file_);
    for (const fs::path& other : configuration_.other_files) fs::remove(other);
  }

  void put(const std::string& text) {
    std::ofstream(file_) << text;
    configuration_.file = file_;
  }
  std::string refusal() const {
    const auto model = configured_model(configuration_);
    if (model) return "taken";
    EXPECT_EQ(model.error().size(), 1U);
    EXPECT_TRUE(model.error().front().key == key_) << model.error().front().key;
    return model.error().front().what;
  }
  // The ball at other phases: it grows by a twentieth and shrinks again.
  void put_others(const std::vector<double>& phases) {
    configuration_.other_phases = phases;
    for (std::size_t k = 0; k < phases.size(); ++k) {
      fs::path other = file_;
      other.replace_extension(std::to_string(k) + ".ply");
      configuration_.other_files.push_back(other);
      put_other(k, ball(12, 1.0 + 0.05 * std::cos(2.0 * std::numbers::pi * (phases[k] - configuration_.phase))));
    }
  }
  void put_other(std::size_t k, const TriangleMesh& mesh) {
    std::ofstream(configuration_.other_files[k]) << ply_text(mesh);
  }

  fs::path file_;
  ModelConfiguration configuration_;
  std::string key_ = "model.file";
};

TEST_F(ConfiguredModel, IsNoneWhereNoFileIsNamed) {
  const auto model = configured_model(configuration_);
  ASSERT_TRUE(model);
  EXPECT_EQ(*model, nullptr);
}

TEST_F(ConfiguredModel, HasItsUnitItsPhaseAndOutwardNormals) {
  put(ply_text(ball(12, 1e-3)));
  configuration_.unit_mm = 1000.0;
  configuration_.phase = 0.25;
  configuration_.shape_mm = 2.5;
  const auto model = configured_model(configuration_);
  ASSERT_TRUE(model) << refusal();
  ASSERT_NE(*model, nullptr);
  const OrganModel& organ = **model;
  EXPECT_NEAR(organ.phase_rad, std::numbers::pi / 2.0, 1e-12);
  EXPECT_EQ(organ.shape_mm, 2.5);
  ASSERT_EQ(organ.normals_W.size(), organ.mesh_W.vertices.size());
  for (std::size_t v = 0; v < organ.normals_W.size(); ++v) {
    EXPECT_NEAR(organ.mesh_W.vertices[v].norm(), 40.0, 1e-3);
    EXPECT_GT(organ.normals_W[v].dot(organ.mesh_W.vertices[v].normalized()), 0.95);
  }
}

TEST_F(ConfiguredModel, IsRefusedWithItsFileAndWhatIsWrong) {
  put("ply\nformat ascii 1.0\nelement vertex 1\n");
  EXPECT_THAT(refusal(), HasSubstr(file_.string()));
  put(ply_text(ball(12, 1e-3)));
  EXPECT_THAT(refusal(), AllOf(HasSubstr(file_.string()), HasSubstr("its unit is"))) << "metres taken for millimetres";
  put(ply_text(ball(80, 1.0)));
  EXPECT_THAT(refusal(), HasSubstr("at most 10000 vertices"));
  fs::remove(file_);
  EXPECT_THAT(refusal(), HasSubstr(file_.string()));
}

TEST_F(ConfiguredModel, OfSeveralPhasesMovesByItself) {
  configuration_.phase = 0.75;
  put(ply_text(ball(12, 1.05)));
  put_others({0.0, 0.25, 0.5, 0.85, 0.35});
  const auto model = configured_model(configuration_);
  ASSERT_TRUE(model) << refusal();
  ASSERT_NE((*model)->motion, nullptr);
  const ModelMotion& motion = *(*model)->motion;
  EXPECT_EQ(motion.harmonics(), 2);
  EXPECT_NEAR(motion.phase_rad(), 1.5 * std::numbers::pi, 1e-12);
  // 2 mm at phase 0.75: the series is -2 sin(phi) along the normal.
  for (std::size_t v = 0; v < 20; ++v) {
    const auto own = motion.of_vertices().middleRows<3>(3 * static_cast<Eigen::Index>(v));
    EXPECT_NEAR(own.col(2).dot((*model)->normals_W[v]), 2.0, 0.05) << v;
    EXPECT_NEAR(own.col(0).norm() + own.col(1).norm() + own.col(3).norm(), 0.0, 1e-3) << v;
  }
}

TEST_F(ConfiguredModel, OtherPhasesThatAreNotOfOneMeshAreRefusedWithTheFileAndWhatDiffers) {
  configuration_.phase = 0.75;
  put(ply_text(ball(12, 1.0)));
  put_others({0.0, 0.25, 0.5});
  ASSERT_EQ(refusal(), "taken");
  const std::string second = configuration_.other_files[1].string();
  key_ = "model.other_files";

  put_other(1, ball(13, 1.0));
  EXPECT_THAT(refusal(), AllOf(HasSubstr(second), HasSubstr("vertices, got")));
  TriangleMesh mesh = ball(12, 1.0);
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  put_other(1, mesh);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(second), HasSubstr("triangles, got")));
  mesh = ball(12, 1.0);
  std::swap(mesh.triangles[100], mesh.triangles[101]);
  put_other(1, mesh);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(second), HasSubstr("with triangle "), HasSubstr("in one order")));
  mesh = ball(12, 1.0);
  for (Vector3d& vertex : mesh.vertices) vertex += Vector3d(0.0, 80.0, 0.0);
  put_other(1, mesh);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(second), HasSubstr("vertex 0 within 50 mm"), HasSubstr("80 mm away")));
  put_other(1, ball(12, 1e-3));
  EXPECT_THAT(refusal(), AllOf(HasSubstr(second), HasSubstr("in metres?")));
  std::ofstream(second) << "ply\nformat ascii 1.0\nelement vertex 1\n";
  EXPECT_THAT(refusal(), HasSubstr(second));
  fs::remove(second);
  EXPECT_THAT(refusal(), HasSubstr(second));
}

TEST_F(ConfiguredModel, OtherPhasesThatTellNoMotionAreRefused) {
  configuration_.phase = 0.75;
  put(ply_text(ball(12, 1.0)));
  put_others({0.0, 0.25, 0.5});
  const auto with = [this](const std::vector<double>& phases) {
    configuration_.other_phases = phases;
    return refusal();
  };
  key_ = "model.other_phases";
  EXPECT_THAT(with({0.0, 0.25}), HasSubstr("expected one for each of the 3 files"));
  EXPECT_THAT(with({0.0, 0.25, 0.75}),
              AllOf(HasSubstr("which is model.phase"), HasSubstr(configuration_.other_files[2].string())));
  EXPECT_THAT(with({0.0, 0.25, 0.25}), HasSubstr("expected phases that differ"));
  EXPECT_THAT(with({0.0, 0.25, 0.9995}), HasSubstr("expected phases that differ")) << "0 once more";
  EXPECT_THAT(with({0.74, 0.76, 0.77}), HasSubstr("too near to each other"));
  key_ = "model.other_files";
  configuration_.other_files.resize(1);
  EXPECT_THAT(with({0.0}), HasSubstr("expected at least 2 beside model.file"));
  configuration_.file.reset();
  EXPECT_THAT(with({0.0}), HasSubstr("expected model.file beside it"));
}

}  // namespace
}  // namespace perimap
