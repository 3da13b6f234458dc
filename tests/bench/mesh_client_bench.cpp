// What a subscriber's evaluation of a surface mesh costs, by perimap_mesh_client.hpp alone. See run.sh.
#include <chrono>
#include <cstdio>
#include <perimap_mesh_client.hpp>
#include <random>
#include <vector>

namespace {

using namespace perimap::client;

// A square of vertices 2 mm apart that beat at random.
struct Square {
  explicit Square(std::uint32_t side) {
    const std::uint32_t V = side * side;
    std::mt19937 random(1);
    std::normal_distribution<float> normal(0.0F, 0.3F);
    coefficients.resize(std::size_t{3} * kBasis * V);
    covariances.assign(std::size_t{6} * V, 0.0F);
    states.assign(V, perimap_VERTEX_SUPPORTED);
    for (float& c : coefficients) c = normal(random);
    for (std::uint32_t v = 0; v < V; ++v) {
      coefficients[v] = 2.0F * static_cast<float>(v % side);
      coefficients[std::size_t{kBasis} * V + v] = 2.0F * static_cast<float>(v / side);
      coefficients[std::size_t{2} * kBasis * V + v] = 100.0F;
      for (const std::size_t e : {0U, 3U, 5U}) covariances[e * V + v] = 0.01F;
    }
    for (std::uint32_t row = 0; row + 1 < side; ++row) {
      for (std::uint32_t column = 0; column + 1 < side; ++column) {
        const std::uint32_t a = row * side + column;
        for (const std::uint32_t corner : {a, a + side, a + 1, a + 1, a + side, a + side + 1})
          triangles.push_back(corner);
      }
    }
    mesh.state = perimap_MESH_THERE;
    mesh.cardiac_harmonics = model.cardiac_harmonics = 8;
    mesh.valid_until_ns = model.valid_until_ns = model.expected_until_ns = cycle.length_ns = 800000000;
    cycle.begin_deviation_ns = 5000000;
    model.state = perimap_SURFACE_GOOD;
    model.cardiac_cycles = {1, 1, &cycle, false};
    point(mesh.vertex_states, states);
    point(mesh.coefficients_W_mm, coefficients);
    point(mesh.covariances_W_mm2, covariances);
    point(mesh.triangles, triangles);
  }
  template <class Sequence, class T>
  static void point(Sequence& sequence, std::vector<T>& values) {
    const auto n = static_cast<std::uint32_t>(values.size());
    sequence = {n, n, values.data(), false};
  }

  static constexpr std::uint32_t kBasis = 17;
  std::vector<float> coefficients, covariances;
  std::vector<std::uint8_t> states;
  std::vector<std::uint32_t> triangles;
  perimap_CardiacCycle cycle{};
  perimap_SurfaceMesh mesh{};
  perimap_SurfaceModel model{};
};

template <class Function>
double milliseconds(Function function) {
  const auto begun = std::chrono::steady_clock::now();
  function();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace

int main() {
  std::printf("vertices  triangles  another mesh  evaluate  nearest point  (ms, the least of 200)\n");
  for (const std::uint32_t side : {32U, 45U, 71U}) {
    Square square(side);
    PredictedMesh out;
    double another = 1e9, evaluate = 1e9, find = 1e9;
    bool known = true;
    const std::array<double, 3> tip = {static_cast<double>(side), static_cast<double>(side), 90.0};
    for (int i = 0; i < 200; ++i) {
      ++square.mesh.sample_sequence;
      const auto at = [&](std::int64_t t_ns) { known = predict(square.mesh, square.model, t_ns, 0, {}, out) && known; };
      another = std::min(another, milliseconds([&] { at(3000000 * i); }));
      evaluate = std::min(evaluate, milliseconds([&] { at(3000000 * i + 1); }));
      find = std::min(find, milliseconds([&] { known = nearest(out, tip).refusal == PointRefusal::kNone && known; }));
    }
    if (!known) return 1;
    std::printf("%8u %10zu %13.3f %9.3f %14.3f\n", side * side, square.triangles.size() / 3, another, evaluate, find);
  }
  return 0;
}
