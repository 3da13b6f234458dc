// Any bytes as a surface of each format and as a registration: an error of one line, or a mesh whose triangles have
// vertices that are there and finite, and which check_mesh() then judges.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "core/registration/mesh_check.hpp"
#include "drivers/calibration/registration_file.hpp"
#include "drivers/mesh_file/mesh_file.hpp"
#include "tests/fuzz/one_line_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  // OBJ is known by its name alone.
  for (const std::string_view name : {"fuzz.obj", "fuzz.stl"}) {
    auto mesh = parse_mesh(bytes, name, 1.0);
    if (!fuzz::is_value(mesh)) continue;
    for (const Vector3d& vertex : mesh->vertices) {
      if (!vertex.allFinite()) std::abort();
    }
    for (const auto& triangle : mesh->triangles) {
      for (const std::uint32_t v : triangle) {
        if (v >= mesh->vertices.size()) std::abort();
      }
    }
    static_cast<void>(fuzz::is_value(check_mesh(*std::move(mesh))));
  }
  const auto registration = parse_registration(bytes, "fuzz.json");
  if (fuzz::is_value(registration) && !(registration->X_IW.t.allFinite() && registration->X_IW.R.allFinite())) {
    std::abort();
  }
  return 0;
}
