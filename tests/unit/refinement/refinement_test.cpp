// A recording of what was published, a model as a file and a start: the registration between them, or why there is
// none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "daemon/refinement/model_refinement.hpp"
#include "drivers/mesh_file/mesh_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_writer.hpp"
#include "made_model.hpp"
#include "made_publication.hpp"

namespace perimap::test {
namespace {

using testing::HasSubstr;

constexpr double kBeat_mm = 2.0;  // outward at the R peak, inward half a cycle later

// The egg, beating along its normals, seen from one side in the tracker's frame, as it is published.
class PublishedEgg {
 public:
  PublishedEgg() {
    for (const auto& triangle : egg_.triangles) {
      const Vector3d& a = egg_.vertices[triangle[0]];
      const Vector3d n = (egg_.vertices[triangle[1]] - a).cross(egg_.vertices[triangle[2]] - a);
      for (const std::uint32_t v : triangle) normals_[v] += n;
      if (n.normalized().dot(Vector3d(1.0, 0.3, 0.2).normalized()) > 0.4) {
        triangles_.insert(triangles_.end(), triangle.begin(), triangle.end());
      }
    }
    for (Vector3d& n : normals_) n.normalize();
  }

  static Pose X_IW() { return {so3_exp(Vector3d(0.4, -0.9, 1.3)), Vector3d(70.0, -20.0, 110.0)}; }

  // As it is at half of the cycle, in its own frame.
  [[nodiscard]] TriangleMesh model() const {
    TriangleMesh mesh = egg_;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh.vertices[v] -= kBeat_mm * normals_[v];
    return mesh;
  }

  perimap_SurfaceMesh& mesh_at(Instant now) {
    const std::size_t V = egg_.vertices.size();
    coefficients_.assign(9 * V, 0.0F);
    covariances_.assign(6 * V, 0.0F);
    states_.assign(V, perimap_VERTEX_SUPPORTED);
    const Pose X_WI = X_IW().inverse();
    for (std::size_t v = 0; v < V; ++v) {
      const Vector3d p = X_WI * egg_.vertices[v], d = kBeat_mm * (X_WI.R * normals_[v]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        coefficients_[(3 * axis) * V + v] = static_cast<float>(p[static_cast<Eigen::Index>(axis)]);
        coefficients_[(3 * axis + 1) * V + v] = static_cast<float>(d[static_cast<Eigen::Index>(axis)]);
      }
      for (const std::size_t diagonal : {0U, 3U, 5U}) covariances_[diagonal * V + v] = 0.01F;
    }
    perimap_SurfaceMesh& mesh = publication_.mesh_at(now, 1);
    mesh.features = 100;
    mesh.leave_one_out_nees = 1.0;
    mesh.vertex_states = {size(states_), size(states_), states_.data(), false};
    mesh.coefficients_W_mm = {size(coefficients_), size(coefficients_), coefficients_.data(), false};
    mesh.covariances_W_mm2 = {size(covariances_), size(covariances_), covariances_.data(), false};
    mesh.triangles = {size(triangles_), size(triangles_), triangles_.data(), false};
    return mesh;
  }
  perimap_SurfaceModel& clocks_at(Instant now) { return publication_.model_at(now, 1); }

 private:
  template <class Values>
  static std::uint32_t size(const Values& values) {
    return static_cast<std::uint32_t>(values.size());
  }

  TriangleMesh egg_ = made_egg();
  std::vector<Vector3d> normals_ = std::vector<Vector3d>(egg_.vertices.size(), Vector3d::Zero());
  std::vector<std::uint32_t> triangles_;
  MadePublication publication_;
  std::vector<float> coefficients_, covariances_;
  std::vector<std::uint8_t> states_;
};

class RefinementTest : public testing::Test {
 protected:
  RefinementTest() {
    std::string name = (std::filesystem::temp_directory_path() / "perimap-refinement-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    source_.model = write("heart.ply", ply_text(egg_.model()));
    source_.registration = write("start.json", registration(start()));
    source_.compare = write("truth.json", registration(PublishedEgg::X_IW()));
    source_.cycle_share = 0.5;
    source_.cycle_share_deviation = 0.0;
    source_.shape_mm = 0.2;
    source_.recording = (folder_ / "published.mcap").string();
  }
  RefinementTest(const RefinementTest&) = delete;
  RefinementTest& operator=(const RefinementTest&) = delete;
  ~RefinementTest() override { std::filesystem::remove_all(folder_); }

  static Pose start() {
    return Pose{so3_exp(Vector3d(0.03, -0.03, 0.03)), Vector3d(1.0, 2.0, -2.0)} * PublishedEgg::X_IW();
  }

  static std::string registration(const Pose& X_IW) {
    double q[4];
    rotation_to_wxyz(X_IW.R, q);
    const auto text = [](double x) { return std::to_string(x); };
    return "{\"translation_mm\": [" + text(X_IW.t.x()) + ", " + text(X_IW.t.y()) + ", " + text(X_IW.t.z()) +
           "], \"rotation_wxyz\": [" + text(q[0]) + ", " + text(q[1]) + ", " + text(q[2]) + ", " + text(q[3]) +
           "], \"covariance\": null}";
  }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  void record(bool with_mesh, bool with_clocks) {
    auto writer = RecordingWriter::create(source_.recording).value();
    const Instant now = from_ns(100'300'000'000);
    if (with_mesh) {
      const auto channel = writer.add_channel<perimap_SurfaceMesh>(channels::kSurfaceMesh).value();
      ASSERT_TRUE(writer.write(channel, egg_.mesh_at(now), now, now, 1));
    }
    if (with_clocks) {
      const auto channel = writer.add_channel<perimap_SurfaceModel>(channels::kSurfaceModel).value();
      ASSERT_TRUE(writer.write(channel, egg_.clocks_at(now), now, now, 1));
    }
    ASSERT_TRUE(writer.finish());
  }

  std::string refusal() const {
    const auto refined = refine_registration(source_);
    return refined ? "none" : refined.error().message;
  }

  PublishedEgg egg_;
  std::filesystem::path folder_;
  RefinementSource source_;
};

TEST_F(RefinementTest, FindsTheRegistrationAtTheModelsOwnPhase) {
  record(true, true);
  const auto refined = refine_registration(source_);
  ASSERT_TRUE(refined) << refined.error().message;
  EXPECT_NEAR(refined->surface.phase_rad, std::numbers::pi, 1e-6);
  ASSERT_TRUE(refined->difference);
  EXPECT_LT(refined->difference->rms_mm, 0.3);
  EXPECT_LT(refined->difference->nees, 1.5);
  EXPECT_GT(refined->fit.moved_mm, 2.0);
  EXPECT_THAT(refined->fit.doubts, testing::IsEmpty());
  EXPECT_EQ(refined->border_edges, 0U);
}

TEST_F(RefinementTest, AtAnotherPhaseItIsAnotherShape) {
  record(true, true);
  source_.cycle_share = 0.0;  // 4 mm further out
  EXPECT_THAT(refusal(), HasSubstr("heart.ply: another shape: "));
}

TEST_F(RefinementTest, WithoutAStartOfItsOwnTheSessionWasRegistered) {
  record(true, true);
  source_.registration.clear();
  // Registered it was not, so that the model is elsewhere.
  EXPECT_THAT(refusal(), HasSubstr("heart.ply: "));
}

TEST_F(RefinementTest, WhatIsMissingInTheRecordingIsSaid) {
  record(false, true);
  EXPECT_THAT(refusal(), HasSubstr("published.mcap: no surface was recorded; expected what perimapd publishes"));
  record(true, false);
  EXPECT_THAT(refusal(),
              HasSubstr("published.mcap: it has no surface to register to: the phases of the heart were not"));
}

TEST_F(RefinementTest, WhyNoSurfaceWasPublishedIsSaid) {
  auto writer = RecordingWriter::create(source_.recording).value();
  const Instant now = from_ns(100'300'000'000);
  perimap_SurfaceMesh mesh{};
  mesh.reason = perimap_MESH_REASON_ON_A_LINE;
  const auto channel = writer.add_channel<perimap_SurfaceMesh>(channels::kSurfaceMesh).value();
  ASSERT_TRUE(writer.write(channel, mesh, now, now, 1));
  ASSERT_TRUE(writer.finish());
  EXPECT_THAT(refusal(), HasSubstr("it has no surface to register to: the features lie on a line"));
}

TEST_F(RefinementTest, WhatIsNoModelIsNamedByItsFile) {
  record(true, true);
  source_.unit_mm = 1000.0;
  EXPECT_THAT(refusal(), HasSubstr("heart.ply: is 155 m large: are its lengths in mm? Then its unit is mm"));
  source_.unit_mm = 1.0;
  TriangleMesh mirrored = egg_.model();
  for (Vector3d& p : mirrored.vertices) p.z() = -p.z();
  source_.model = write("mirrored.ply", ply_text(mirrored));
  EXPECT_THAT(refusal(), HasSubstr("mirrored.ply: its triangles face inwards: it is mirrored, or inside out"));
  source_.model = (folder_ / "none.stl").string();
  EXPECT_THAT(refusal(), HasSubstr("none.stl: expected a readable surface"));
}

}  // namespace
}  // namespace perimap::test
