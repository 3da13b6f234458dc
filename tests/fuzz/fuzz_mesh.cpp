// Any bytes as a surface of each format and as a registration: an error of one line, or a mesh whose triangles have
// vertices that are there and finite, and which check_mesh() then judges.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include "core/registration/mesh_check.hpp"
#include "drivers/calibration/registration_file.hpp"
#include "drivers/mesh_file/mesh_file.hpp"

namespace {

void check_error(const perimap::Error& error) {
  if (error.message.find_first_of("\r\n") != std::string::npos) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  // OBJ is known by its name alone.
  for (const std::string_view name : {"fuzz.obj", "fuzz.stl"}) {
    auto mesh = parse_mesh(bytes, name, 1.0);
    if (!mesh) {
      check_error(mesh.error());
      continue;
    }
    for (const Vector3d& vertex : mesh->vertices) {
      if (!vertex.allFinite()) std::abort();
    }
    for (const auto& triangle : mesh->triangles) {
      for (const std::uint32_t v : triangle) {
        if (v >= mesh->vertices.size()) std::abort();
      }
    }
    const auto checked = check_mesh(*std::move(mesh));
    if (!checked) check_error(checked.error());
  }
  if (const auto registration = parse_registration(bytes, "fuzz.json"); !registration) {
    check_error(registration.error());
  } else if (!registration->X_IW.t.allFinite() || !registration->X_IW.R.allFinite()) {
    std::abort();
  }
  return 0;
}
