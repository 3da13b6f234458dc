#include "daemon/runtime/configured_model.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <numbers>
#include <string>
#include <utility>

#include "core/registration/mesh_check.hpp"
#include "drivers/mesh_file/mesh_file.hpp"

namespace perimap {
namespace {

// 2 MB a second to each reader, with eight harmonics; a heart with a vertex each 3 mm has 3000.
constexpr std::size_t kMostVertices = 10'000;

}  // namespace

tl::expected<std::shared_ptr<const OrganModel>, WrongKeys> configured_model(const ModelConfiguration& configuration) {
  const auto wrong = [](std::string what) { return tl::unexpected(WrongKeys{{"model.file", std::move(what)}}); };
  if (!configuration.file) return nullptr;
  auto mesh = read_mesh(*configuration.file, configuration.unit_mm);
  if (!mesh) return wrong(mesh.error().message);
  auto checked = check_mesh(*std::move(mesh));
  if (!checked) return wrong(fmt::format("{}: {}", configuration.file->string(), checked.error().message));
  if (checked->mesh.vertices.size() > kMostVertices) {
    return wrong(
        fmt::format("expected a surface of at most {} vertices, got one of {}: simplify it, to one about each 3 mm",
                    kMostVertices, checked->mesh.vertices.size()));
  }
  auto model = std::make_shared<OrganModel>();
  model->mesh_W = std::move(checked->mesh);
  model->normals_W = vertex_normals(model->mesh_W);
  // In a cycle of the length at which all laws of the phase are even.
  model->phase_rad = 2.0 * std::numbers::pi * configuration.phase;
  model->shape_mm = configuration.shape_mm;
  model->registration_mm = configuration.registration_mm;
  return model;
}

}  // namespace perimap
