#include "daemon/runtime/configured_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/registration/mesh_check.hpp"
#include "drivers/mesh_file/mesh_file.hpp"

namespace perimap {
namespace {

// 2 MB a second to each reader, with eight harmonics; a heart with a vertex each 3 mm has 3000.
constexpr std::size_t kMostVertices = 10'000;
// A motion has three numbers: where a place is in the mean, and a harmonic.
constexpr std::size_t kFewestPhases = 3;
// Nearer than this they are one; a scan of 64 phases has them at 0.016.
constexpr double kSamePhase = 1e-3;
// A heart's base, which moves most, descends by some 15 mm: what moves further is elsewhere, or of another unit.
constexpr double kFarthest_mm = 50.0;

using Told = tl::unexpected<WrongKeys>;

Told wrong(const char* key, std::string what) { return tl::unexpected(WrongKeys{{key, std::move(what)}}); }

Expected<TriangleMesh> read_checked(const std::filesystem::path& file, double unit_mm) {
  auto mesh = read_mesh(file, unit_mm);
  if (!mesh) return tl::unexpected(std::move(mesh.error()));
  auto checked = check_mesh(*std::move(mesh));
  if (!checked) return fail(fmt::format("{}: {}", file.string(), checked.error().message));
  return std::move(checked->mesh);
}

std::string corners_text(const TriangleMesh::Triangle& triangle) {
  return fmt::format("{} {} {}", triangle[0], triangle[1], triangle[2]);
}

// What of another phase's mesh is not as the model's; nothing when it is the same one.
std::optional<std::string> difference(const TriangleMesh& mesh, const TriangleMesh& other) {
  if (other.vertices.size() != mesh.vertices.size()) {
    return fmt::format("{} vertices, got {}", mesh.vertices.size(), other.vertices.size());
  }
  if (other.triangles.size() != mesh.triangles.size()) {
    return fmt::format("{} triangles, got {}", mesh.triangles.size(), other.triangles.size());
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (other.triangles[t] == mesh.triangles[t]) continue;
    return fmt::format("triangle {} of vertices {}, got {}: export all phases from one mesh, in one order", t,
                       corners_text(mesh.triangles[t]), corners_text(other.triangles[t]));
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double moved_mm = (other.vertices[v] - mesh.vertices[v]).norm();
    if (moved_mm <= kFarthest_mm) continue;
    return fmt::format(
        "vertex {} within {} mm of where the model has it, got {:.0f} mm away: it is of another frame, "
        "or its vertices are in another order",
        v, kFarthest_mm, moved_mm);
  }
  return std::nullopt;
}

// Shares of a cycle that stand for the same phase.
bool are_one(double a, double b) {
  const double apart = std::abs(a - b);
  return std::min(apart, std::abs(1.0 - apart)) < kSamePhase;
}

tl::expected<void, WrongKeys> check_phases(const ModelConfiguration& configuration) {
  const std::vector<double>& phases = configuration.other_phases;
  if (phases.size() != configuration.other_files.size()) {
    return wrong("model.other_phases", fmt::format("expected one for each of the {} files of model.other_files, got {}",
                                                   configuration.other_files.size(), phases.size()));
  }
  if (phases.size() + 1 < kFewestPhases) {
    return wrong("model.other_files", fmt::format("expected at least {} beside model.file, to tell a motion, got {}",
                                                  kFewestPhases - 1, phases.size()));
  }
  for (std::size_t k = 0; k < phases.size(); ++k) {
    if (are_one(phases[k], configuration.phase)) {
      return wrong("model.other_phases", fmt::format("expected phases that differ, got {} for {}, which is model.phase",
                                                     phases[k], configuration.other_files[k].string()));
    }
    for (std::size_t j = 0; j < k; ++j) {
      if (!are_one(phases[k], phases[j])) continue;
      return wrong("model.other_phases", fmt::format("expected phases that differ, got {} for {} and {} for {}",
                                                     phases[j], configuration.other_files[j].string(), phases[k],
                                                     configuration.other_files[k].string()));
    }
  }
  return {};
}

// In a cycle of the length at which all laws of the phase are even.
double phase_rad(double share) { return 2.0 * std::numbers::pi * share; }

// How the model moves by itself; null where it is of one phase.
tl::expected<std::shared_ptr<const ModelMotion>, WrongKeys> motion_of(const ModelConfiguration& configuration,
                                                                      const TriangleMesh& mesh) {
  if (configuration.other_files.empty() && configuration.other_phases.empty()) return nullptr;
  if (auto good = check_phases(configuration); !good) return tl::unexpected(std::move(good.error()));
  std::vector<double> phases_rad = {phase_rad(configuration.phase)};
  PlacesByPhase vertices_mm = {mesh.vertices};
  for (std::size_t k = 0; k < configuration.other_files.size(); ++k) {
    const std::filesystem::path& file = configuration.other_files[k];
    auto other = read_checked(file, configuration.unit_mm);
    if (!other) return wrong("model.other_files", std::move(other.error().message));
    if (const auto differs = difference(mesh, *other)) {
      return wrong("model.other_files", fmt::format("{}: expected the mesh of {} at another phase, with {}",
                                                    file.string(), configuration.file->string(), *differs));
    }
    phases_rad.push_back(phase_rad(configuration.other_phases[k]));
    vertices_mm.push_back(std::move(other->vertices));
  }
  if (harmonics_told(phases_rad) == 0) {
    return wrong("model.other_phases",
                 "expected phases spread over the cycle, got some that lie too near to each other "
                 "to tell one harmonic of a motion");
  }
  return std::make_shared<const ModelMotion>(phases_rad, vertices_mm, mesh.triangles);
}

}  // namespace

tl::expected<std::shared_ptr<const OrganModel>, WrongKeys> configured_model(const ModelConfiguration& configuration) {
  if (!configuration.file) {
    const char* const needs = !configuration.other_files.empty()    ? "model.other_files"
                              : !configuration.other_phases.empty() ? "model.other_phases"
                                                                    : nullptr;
    if (needs == nullptr) return nullptr;
    return wrong(needs, "expected model.file beside it, whose other phases these are, got none");
  }
  auto mesh = read_checked(*configuration.file, configuration.unit_mm);
  if (!mesh) return wrong("model.file", std::move(mesh.error().message));
  if (mesh->vertices.size() > kMostVertices) {
    return wrong("model.file", fmt::format("expected a surface of at most {} vertices, got one of {}: simplify it, to "
                                           "one about each 3 mm",
                                           kMostVertices, mesh->vertices.size()));
  }
  auto motion = motion_of(configuration, *mesh);
  if (!motion) return tl::unexpected(std::move(motion.error()));
  auto model = std::make_shared<OrganModel>();
  model->motion = *std::move(motion);
  model->mesh_W = *std::move(mesh);
  model->normals_W = vertex_normals(model->mesh_W);
  model->phase_rad = phase_rad(configuration.phase);
  model->shape_mm = configuration.shape_mm;
  model->registration_mm = configuration.registration_mm;
  return model;
}

}  // namespace perimap
