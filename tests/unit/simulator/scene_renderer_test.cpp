#include "drivers/standins/simulator/scene_renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {
namespace {

struct Image {
  int width, height;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] double at(int u, int v) const { return pixels[static_cast<std::size_t>(v) * width + u]; }
};

Simulation simulate(int width, int height, const ParallelFor& parallel_for = serial_for) {
  SimulationSettings settings;
  settings.width = width;
  settings.height = height;
  settings.duration = std::chrono::seconds(10);
  return Simulation::create(settings, parallel_for).value();
}

Image render(const Simulation& simulation, std::size_t frame, RenderWorkspace& workspace) {
  const SimulationSettings& s = simulation.settings();
  Image image{s.width, s.height, std::vector<std::uint8_t>(static_cast<std::size_t>(s.width) * s.height)};
  simulation.render(frame, workspace, image.pixels);
  return image;
}

constexpr int kHalf = 6;  // of the patch that is correlated

double standard_deviation(const Image& image, int u, int v) {
  double sum = 0.0;
  double sum2 = 0.0;
  for (int dv = -kHalf; dv <= kHalf; ++dv)
    for (int du = -kHalf; du <= kHalf; ++du) {
      sum += image.at(u + du, v + dv);
      sum2 += image.at(u + du, v + dv) * image.at(u + du, v + dv);
    }
  constexpr double kCount = (2 * kHalf + 1) * (2 * kHalf + 1);
  return std::sqrt(std::max(0.0, sum2 / kCount - sum * sum / (kCount * kCount)));
}

double bilinear(const Image& image, const Vector2d& pixel) {
  const int u = static_cast<int>(pixel.x());
  const int v = static_cast<int>(pixel.y());
  const double du = pixel.x() - u;
  const double dv = pixel.y() - v;
  return (1.0 - dv) * ((1.0 - du) * image.at(u, v) + du * image.at(u + 1, v)) +
         dv * ((1.0 - du) * image.at(u, v + 1) + du * image.at(u + 1, v + 1));
}

// Normalised correlation of the patch of `a` about (u, v) with that of `b` about `centre`, deformed by `warp`.
double correlation(const Image& a, int u, int v, const Image& b, const Vector2d& centre, const Matrix2d& warp) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int dv = -kHalf; dv <= kHalf; ++dv)
    for (int du = -kHalf; du <= kHalf; ++du) {
      const double x = a.at(u + du, v + dv);
      const double y = bilinear(b, centre + warp * Vector2d(du, dv));
      sa += x;
      sb += y;
      saa += x * x;
      sbb += y * y;
      sab += x * y;
    }
  constexpr double kCount = (2 * kHalf + 1) * (2 * kHalf + 1);
  return (kCount * sab - sa * sb) / std::sqrt(std::max(1e-9, (kCount * saa - sa * sa) * (kCount * sbb - sb * sb)));
}

// Where the patch of `a` about (u, v) correlates best in `b` within 2 px of `guess`, by a parabola through the peak.
// Nothing when the peak lies at the search's border or is low.
std::optional<Vector2d> correlated(const Image& a, int u, int v, const Image& b, const Vector2d& guess,
                                   const Matrix2d& warp) {
  constexpr int kSearch = 2;
  const double margin = 2 * kHalf + kSearch;
  if (guess.x() < margin || guess.y() < margin || guess.x() > b.width - margin || guess.y() > b.height - margin)
    return std::nullopt;
  double c[2 * kSearch + 1][2 * kSearch + 1];
  int best_u = 0;
  int best_v = 0;
  for (int dv = 0; dv <= 2 * kSearch; ++dv)
    for (int du = 0; du <= 2 * kSearch; ++du) {
      c[dv][du] = correlation(a, u, v, b, guess + Vector2d(du - kSearch, dv - kSearch), warp);
      if (c[dv][du] > c[best_v][best_u]) {
        best_u = du;
        best_v = dv;
      }
    }
  if (best_u % (2 * kSearch) == 0 || best_v % (2 * kSearch) == 0 || c[best_v][best_u] < 0.9) return std::nullopt;
  const auto peak = [](double before, double middle, double after) {
    return 0.5 * (before - after) / (before - 2.0 * middle + after);
  };
  const double best = c[best_v][best_u];
  return Vector2d(guess.x() + best_u - kSearch + peak(c[best_v][best_u - 1], best, c[best_v][best_u + 1]),
                  guess.y() + best_v - kSearch + peak(c[best_v - 1][best_u], best, c[best_v + 1][best_u]));
}

TEST(SceneRenderer, MaterialPointsAppearWhereGroundTruthPutsThem) {
  const Simulation simulation = simulate(320, 240);
  const GroundTruth& truth = simulation.truth();
  RenderWorkspace workspace;
  std::vector<double> errors;
  std::vector<double> motions;
  for (const std::size_t first : {20U, 120U, 230U}) {
    const Simulation::Frame& frame_a = simulation.frames()[first];
    const Image a = render(simulation, first, workspace);
    for (const std::size_t later : {2U, 5U, 8U}) {
      const Simulation::Frame& frame_b = simulation.frames()[first + later];
      const Image b = render(simulation, first + later, workspace);
      for (int v = 20; v < 220; v += 25)
        for (int u = 20; u < 300; u += 25) {
          if (standard_deviation(a, u, v) < 12.0) continue;
          // Where the material seen at a pixel of the first frame lies in the later one.
          const auto moved = [&](double from_u, double from_v) -> std::optional<Vector2d> {
            const auto point =
                truth.first_hit(frame_a.X_WC, simulation.lens().ray({from_u, from_v}), frame_a.stamp.capture);
            if (!point) return std::nullopt;
            return simulation.lens().project(frame_b.X_WC.inverse() * truth.position(*point, frame_b.stamp.capture));
          };
          const auto middle = moved(u, v);
          const auto right = moved(u + kHalf, v);
          const auto left = moved(u - kHalf, v);
          const auto below = moved(u, v + kHalf);
          const auto above = moved(u, v - kHalf);
          if (!middle || !right || !left || !below || !above) continue;
          Matrix2d warp;
          warp << (*right - *left) / (2.0 * kHalf), (*below - *above) / (2.0 * kHalf);
          const Vector2d expected = *middle;
          const auto found = correlated(a, u, v, b, expected, warp);
          if (!found) continue;
          errors.push_back((*found - expected).norm());
          motions.push_back((expected - Vector2d(u, v)).norm());
        }
    }
  }
  ASSERT_GT(errors.size(), 100U);
  const auto half = static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), errors.begin() + half, errors.end());
  std::nth_element(motions.begin(), motions.begin() + half, motions.end());
  RecordProperty("median_error_px", std::to_string(errors[errors.size() / 2]));
  RecordProperty("median_motion_px", std::to_string(motions[motions.size() / 2]));
  EXPECT_GT(motions[motions.size() / 2], 2.0) << "the test needs motion to mean anything";
  EXPECT_LT(errors[errors.size() / 2], 0.15);
}

TEST(SceneRenderer, TheHeartFillsMostOfTheViewAndIsNeitherDarkNorBlownOut) {
  const Simulation simulation = simulate(160, 120);
  RenderWorkspace workspace;
  for (const std::size_t frame : {0U, 100U, 200U}) {
    const Image image = render(simulation, frame, workspace);
    int heart = 0;
    int saturated = 0;
    for (const std::uint8_t pixel : image.pixels) {
      heart += pixel > 35 ? 1 : 0;
      saturated += pixel == 255 ? 1 : 0;
    }
    const auto count = static_cast<double>(image.pixels.size());
    EXPECT_GT(heart / count, 0.5);
    EXPECT_LT(saturated / count, 0.02);
  }
}

TEST(SceneRenderer, SeenPixelsAndMissedRaysAgreeWithGroundTruth) {
  const Simulation simulation = simulate(160, 120);
  RenderWorkspace workspace;
  const Simulation::Frame& frame = simulation.frames()[77];
  render(simulation, 77, workspace);
  const int stride = static_cast<int>(workspace.triangle_seen.size()) / (2 * 120);
  int disagreements = 0;
  int seen = 0;
  for (int row = 3; row < 240; row += 8)
    for (int column = 3; column < 320; column += 8) {
      const auto drawn = workspace.triangle_seen[static_cast<std::size_t>(row) * stride + column];
      const Vector2d pixel(0.5 * column - 0.25, 0.5 * row - 0.25);
      const auto hit = simulation.truth().first_hit(frame.X_WC, simulation.lens().ray(pixel), frame.stamp.capture);
      seen += hit ? 1 : 0;
      disagreements += (hit ? static_cast<std::int32_t>(hit->triangle) : -1) != drawn ? 1 : 0;
    }
  EXPECT_GT(seen, 500);
  // Single-precision rays may fall on the other side of an edge now and then.
  EXPECT_LE(disagreements, 2);
}

TEST(SceneRenderer, SameSeedGivesTheSameImageWhateverTheThreads) {
  const ParallelFor two_threads = [](int count, const std::function<void(int)>& body) {
    std::thread odd([&] {
      for (int i = 1; i < count; i += 2) body(i);
    });
    for (int i = 0; i < count; i += 2) body(i);
    odd.join();
  };
  const Simulation one = simulate(96, 64);
  const Simulation two = simulate(96, 64, two_threads);
  RenderWorkspace fresh;
  RenderWorkspace used;
  render(two, 3, used);
  EXPECT_EQ(render(one, 40, fresh).pixels, render(two, 40, used).pixels);

  SimulationSettings other = one.settings();
  other.seed = 2;
  EXPECT_NE(render(one, 40, fresh).pixels, render(Simulation::create(other).value(), 40, used).pixels);
}

}  // namespace
}  // namespace perimap
