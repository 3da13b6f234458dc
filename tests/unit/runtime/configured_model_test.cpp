#include "daemon/runtime/configured_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

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
  ~ConfiguredModel() override { fs::remove(file_); }

  void put(const std::string& text) {
    std::ofstream(file_) << text;
    configuration_.file = file_;
  }
  std::string refusal() const {
    const auto model = configured_model(configuration_);
    if (model) return "taken";
    EXPECT_EQ(model.error().size(), 1U);
    EXPECT_EQ(model.error().front().key, "model.file");
    return model.error().front().what;
  }

  fs::path file_;
  ModelConfiguration configuration_;
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

}  // namespace
}  // namespace perimap
