// mesh_reader DOMAIN SECONDS: reads perimap/surface_mesh by eProsima Fast DDS, with a type that fastddsgen made of
// idl/perimap_mesh.idl, and holds it against the mesh that scripted_publisher makes.
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "fast_reader.hpp"
#include "perimap_meshPubSubTypes.h"

namespace {

using perimap::test::expect;

constexpr std::size_t kVertices = 5;

bool judge(const perimap::SurfaceMesh& mesh) {
  expect(mesh.source() == "made" && mesh.run_id()[0] == 1 && mesh.run_id()[15] == 0, "whose it is");
  expect(mesh.state() == perimap::MESH_THERE && mesh.phase_law() == 0, "state and law");
  expect(mesh.valid_until_ns() == mesh.time_ns() + 5'000'000'000, "until when it holds");
  expect(mesh.time_utc_ns() - mesh.time_ns() == 1'795'000'000'123'456'789, "UTC");
  expect(mesh.vertex_states() == std::vector<std::uint8_t>{perimap::VERTEX_UNCERTAIN, 0, 0, 0, 0}, "vertex states");
  expect(mesh.triangles() == std::vector<std::uint32_t>{1, 2, 3, 2, 4, 3}, "triangles");
  const auto& c = mesh.coefficients_W_mm();
  expect(c.size() == 9 * kVertices, "number of coefficients");
  for (std::size_t v = 0; v < kVertices && c.size() == 9 * kVertices; ++v) {
    const auto i = static_cast<float>(v);
    const std::array<float, 3> rest = {v % 2 == 0 ? 0.0F : 8.0F, 6.0F * i, 90.0F + i};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      expect(c[3 * axis * kVertices + v] == rest[axis], "mean of a vertex");
      expect(c[(3 * axis + 1) * kVertices + v] == (axis == 2 ? 2.0F : 0.0F), "cosine of a vertex");
      expect(c[(3 * axis + 2) * kVertices + v] == 0.0F, "sine of a vertex");
    }
    expect(mesh.covariances_W_mm2().at(v) == 0.04F && mesh.covariances_W_mm2().at(kVertices + v) == 0.0F,
           "covariance of a vertex");
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace perimap::test;
  if (argc != 3) {
    std::fputs("usage: mesh_reader DOMAIN SECONDS\n", stderr);
    return 2;
  }
  FastDomain domain(std::atoi(argv[1]));
  const FastReader<perimap::SurfaceMesh, perimap::SurfaceMeshPubSubType> meshes(domain, "perimap/surface_mesh", judge);
  const bool right = wait_for(std::atoi(argv[2]), [&] { return meshes.content() >= 3; });
  std::printf("Fast DDS read %d meshes; wrong: %d\n", meshes.content(), wrong.load());
  std::fflush(stdout);
  std::_Exit(right ? 0 : 1);  // what Fast DDS still runs needs no end
}
