#include "core/calibration/field_stop.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/edge_on_ray.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

double median_of(std::vector<double> values) {
  return values.empty() ? 0.0 : upper_median(values.begin(), values.end());
}

// Between the surround and the picture (Otsu, IEEE Trans. SMC 9(1), 1979), taken of every other pixel; the two classes'
// means beside it, and where the surround's own noise ends.
struct Levels {
  double threshold = 0.0;
  double dark = 0.0;
  double bright = 0.0;
  double edge = 0.0;
};

// The darkest grey level that leaves so much of the histogram's beginning at or below it.
double quantile_of(const std::array<double, 256>& histogram, double count) {
  double below = 0.0;
  std::size_t i = 0;
  while (i + 1 < histogram.size() && (below += histogram[i]) < count) ++i;
  return static_cast<double>(i);
}

// Most of what is dark is the surround, and its noise reaches as far up as down. Not much above that, for vessels at
// the picture's rim, where it is darker than in its middle, are not part of the surround.
double edge_level(const std::array<double, 256>& histogram, const Levels& levels) {
  const auto dark_end = histogram.begin() + static_cast<std::ptrdiff_t>(std::clamp(levels.threshold + 0.5, 1.0, 255.0));
  const double all_dark = std::accumulate(histogram.begin(), dark_end, 0.0);
  const double surround = quantile_of(histogram, 0.5 * all_dark);
  const double noise = surround - quantile_of(histogram, 0.16 * all_dark);
  constexpr double kLeast = 4.0;  // grey levels
  return surround + std::max({kLeast, 3.5 * noise, 0.05 * (levels.bright - surround)});
}

Levels levels_of(const GreyImage& picture) {
  std::array<double, 256> histogram{};
  for (int y = 0; y < picture.height; y += 2) {
    const std::uint8_t* row = picture.data + y * picture.stride;
    for (int x = 0; x < picture.width; x += 2) histogram[row[x]] += 1.0;
  }
  const double all = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < histogram.size(); ++i) sum += static_cast<double>(i) * histogram[i];
  Levels best;
  double largest = -1.0;
  double below = 0.0;
  double below_sum = 0.0;
  for (std::size_t i = 0; i + 1 < histogram.size(); ++i) {
    below += histogram[i];
    below_sum += static_cast<double>(i) * histogram[i];
    if (below == 0.0 || below == all) continue;
    const double dark = below_sum / below;
    const double bright = (sum - below_sum) / (all - below);
    const double between = below * (all - below) * (bright - dark) * (bright - dark);
    if (between > largest) largest = between, best = {static_cast<double>(i) + 0.5, dark, bright, 0.0};
  }
  best.edge = edge_level(histogram, best);
  return best;
}

Vector2d direction_of(double angle) { return {std::cos(angle), std::sin(angle)}; }

struct Circle {
  Vector2d centre = Vector2d::Zero();
  double radius = 0.0;
};

// Least squares of x^2 + y^2 = 2 a x + 2 b y + c (Kasa 1976), about the points' middle.
std::optional<Circle> circle_through(const std::vector<Vector2d>& points) {
  if (points.size() < 3) return std::nullopt;
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& p : points) middle += p / static_cast<double>(points.size());
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const Vector2d& p : points) {
    const Vector2d d = p - middle;
    const Vector3d row(2.0 * d.x(), 2.0 * d.y(), 1.0);
    A += row * row.transpose();
    b += row * d.squaredNorm();
  }
  const Eigen::FullPivLU<Matrix3d> lu(A);
  if (!lu.isInvertible()) return std::nullopt;
  const Vector3d solved = lu.solve(b);
  const double square = solved.z() + solved.head<2>().squaredNorm();
  if (!(square > 0.0)) return std::nullopt;
  return Circle{middle + solved.head<2>(), std::sqrt(square)};
}

double off_by(const Circle& circle, const Vector2d& p) { return (p - circle.centre).norm() - circle.radius; }

// The circle that most of the points lie on.
std::optional<Circle> common_circle(const std::vector<Vector2d>& points, double largest_radius) {
  constexpr int kTrials = 300;
  constexpr double kNear_px = 2.0;
  std::optional<Circle> best;
  std::size_t most = 0;
  std::uint64_t state = 1;
  const auto draw = [&] {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::size_t>((state >> 33) % points.size());
  };
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto circle = circle_through({points[draw()], points[draw()], points[draw()]});
    if (!circle || circle->radius > largest_radius) continue;
    const auto near = static_cast<std::size_t>(std::count_if(
        points.begin(), points.end(), [&](const Vector2d& p) { return std::abs(off_by(*circle, p)) < kNear_px; }));
    if (near > most) most = near, best = circle;
  }
  for (int round = 0; best && round < 4; ++round) {
    std::vector<Vector2d> near;
    for (const Vector2d& p : points) {
      if (std::abs(off_by(*best, p)) < kNear_px) near.push_back(p);
    }
    if (const auto fitted = circle_through(near)) best = fitted;
  }
  return best;
}

// How far inside the circle the edge lies, by the angle; not a number where it is not seen.
struct Profile {
  std::vector<double> depth_px;
  double step_rad = 0.0;

  [[nodiscard]] double angle(std::size_t i) const {
    return -std::numbers::pi + (static_cast<double>(i) + 0.5) * step_rad;
  }
  [[nodiscard]] double at(std::size_t i, std::ptrdiff_t k) const {
    const auto n = static_cast<std::ptrdiff_t>(depth_px.size());
    return depth_px[static_cast<std::size_t>(((static_cast<std::ptrdiff_t>(i) + k) % n + n) % n)];
  }
};

Profile profile_of(const GreyImage& picture, double level, const Circle& circle) {
  Profile profile;
  const auto count = static_cast<std::size_t>(std::max(180.0, kTwoPi * circle.radius));
  profile.step_rad = kTwoPi / static_cast<double>(count);
  profile.depth_px.resize(count);
  constexpr double kOutside_px = 5.0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto r =
        edge_on_ray(picture, level, circle.centre, profile.angle(i), circle.radius + kOutside_px, 0.6 * circle.radius);
    profile.depth_px[i] = r ? circle.radius - *r : std::nan("");
  }
  return profile;
}

// Sum over `half` places to both sides of each, of what is more than noise; what is not seen counts as nothing.
std::vector<double> swept(const Profile& profile, std::ptrdiff_t half, double noise) {
  std::vector<double> sums(profile.depth_px.size(), 0.0);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    for (std::ptrdiff_t k = -half; k <= half; ++k) {
      const double depth = profile.at(i, k);
      if (depth > noise) sums[i] += depth;
    }
  }
  return sums;
}

// By what the notch's own estimator makes of the rest of the circle, where there is no notch: windows that half
// overlap, a few of which may hold something else.
double edge_density(const Profile& profile, std::ptrdiff_t half, std::size_t notch, double least_deviation_px) {
  const auto n = static_cast<std::ptrdiff_t>(profile.depth_px.size());
  std::vector<double> moments;
  double squares = 0.0;
  for (std::ptrdiff_t k = -half; k <= half; ++k) squares += static_cast<double>(k * k);
  for (std::ptrdiff_t away = 3 * half; away <= n - 3 * half; away += half) {
    double moment = 0.0;
    bool seen = true;
    for (std::ptrdiff_t k = -half; seen && k <= half; ++k) {
      const double depth = profile.at(notch, away + k);
      seen = !std::isnan(depth);
      moment += static_cast<double>(k) * depth;
    }
    if (seen) moments.push_back(std::abs(moment));
  }
  // Of a circle that is mostly cut off too few say: two and a half places in a row share pixels at least.
  constexpr std::size_t kFewest = 8;
  constexpr double kShared = 2.5;
  const double least = moments.size() < kFewest ? std::sqrt(kShared) * least_deviation_px : least_deviation_px;
  const double deviation = 1.4826 * median_of(moments) / std::sqrt(squares);
  return profile.step_rad * std::pow(std::max(deviation, least), 2.0);
}

Expected<void> find_notch(const Profile& profile, FieldStopReading& reading) {
  const double noise = std::max(1.0, 4.0 * reading.edge_deviation_px);
  constexpr double kHalf_rad = 0.10;  // wider than half a notch
  const auto half = static_cast<std::ptrdiff_t>(std::max(3.0, kHalf_rad / profile.step_rad));
  const std::vector<double> sums = swept(profile, half, noise);
  const auto top = static_cast<std::size_t>(std::max_element(sums.begin(), sums.end()) - sums.begin());
  double deepest = 0.0;
  for (std::ptrdiff_t k = -half; k <= half; ++k) {
    const double depth = profile.at(top, k);
    if (depth > deepest) deepest = depth;
  }
  if (deepest < 2.0 * noise) {
    return fail(
        "the field stop has no notch in the picture: turn the scope until it is in view, zoom out, or track the scope "
        "by a sensor of its own");
  }
  const auto n = static_cast<std::ptrdiff_t>(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto apart = std::abs(static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(top));
    if (std::min(apart, n - apart) > 2 * half && sums[i] > 0.6 * sums[top]) {
      return fail("the field stop has two notches, or something dark lies across the picture's edge: wipe the lens");
    }
  }
  // The middle of the notch's area; its window moves with it.
  double offset = 0.0;
  double area = 0.0;
  double squares = 0.0;
  for (int round = 0; round < 8; ++round) {
    const auto moved = static_cast<std::ptrdiff_t>(std::lround(offset));
    double moment = 0.0;
    area = squares = 0.0;
    for (std::ptrdiff_t k = moved - half; k <= moved + half; ++k) {
      const double depth = profile.at(top, k);
      if (std::isnan(depth)) continue;
      area += depth;
      moment += depth * static_cast<double>(k);
      squares += (static_cast<double>(k) - offset) * (static_cast<double>(k) - offset);
    }
    if (!(area > 0.0)) return fail("the field stop's notch is not whole in the picture: zoom out");
    offset =
        std::clamp(moment / area, offset - 0.5 * static_cast<double>(half), offset + 0.5 * static_cast<double>(half));
  }
  const double angle = profile.angle(top) + offset * profile.step_rad;
  reading.notch_rad = std::remainder(angle, kTwoPi);
  reading.notch_depth_px = deepest;
  reading.edge_density_px2_rad = edge_density(profile, half, top, reading.edge_deviation_px);
  // The centre's error turns it too.
  const double by_edge = std::sqrt(reading.edge_density_px2_rad * profile.step_rad * squares) / area;
  reading.notch_deviation_rad = std::hypot(by_edge, reading.centre_deviation_px / reading.radius_px);
  return {};
}

}  // namespace

Expected<FieldStopReading> read_field_stop(const GreyImage& picture) {
  constexpr double kLeastContrast = 20.0;  // grey levels
  constexpr int kSmallest_px = 32;
  if (picture.width < kSmallest_px || picture.height < kSmallest_px) {
    return fail("the picture is smaller than 32 pixels: no field stop can be read in it");
  }
  const Levels levels = levels_of(picture);
  const char* const no_stop =
      "no field stop is seen: the picture has no dark surround with a round edge; zoom out until its edge is in view, "
      "and look at something bright";
  if (levels.bright - levels.dark < kLeastContrast) return fail(no_stop);
  const Vector2d middle(0.5 * (picture.width - 1), 0.5 * (picture.height - 1));
  const double diagonal = std::hypot(picture.width, picture.height);
  const double low = levels.edge;
  std::vector<Vector2d> edge;
  constexpr int kRays = 720;
  for (int k = 0; k < kRays; ++k) {
    const double angle = kTwoPi * k / kRays;
    const auto r = edge_on_ray(picture, low, middle, angle, 0.5 * diagonal, 0.1 * diagonal);
    if (r) edge.emplace_back(middle + *r * direction_of(angle));
  }
  constexpr std::size_t kFewest = kRays / 5;
  if (edge.size() < kFewest) return fail(no_stop);
  const auto circle = common_circle(edge, diagonal);
  if (!circle) return fail(no_stop);
  Circle fitted = *circle;
  Profile profile;
  FieldStopReading reading;
  for (int round = 0; round < 3; ++round) {
    profile = profile_of(picture, low, fitted);
    std::vector<double> sizes;
    for (const double d : profile.depth_px) {
      if (!std::isnan(d)) sizes.push_back(std::abs(d));
    }
    if (sizes.size() < profile.depth_px.size() / 4) return fail(no_stop);
    reading.seen_share = static_cast<double>(sizes.size()) / static_cast<double>(profile.depth_px.size());
    reading.edge_deviation_px = std::max(0.05, 1.4826 * median_of(sizes));
    std::vector<Vector2d> near;
    for (std::size_t i = 0; i < profile.depth_px.size(); ++i) {
      if (!(std::abs(profile.depth_px[i]) < 4.0 * reading.edge_deviation_px)) continue;
      near.emplace_back(fitted.centre + (fitted.radius - profile.depth_px[i]) * direction_of(profile.angle(i)));
    }
    if (const auto again = circle_through(near)) fitted = *again;
    reading.centre_deviation_px = reading.edge_deviation_px *
                                  std::sqrt(2.0 * 2.0 / static_cast<double>(std::max<std::size_t>(1, near.size()))) /
                                  std::max(0.05, reading.seen_share);
  }
  if (reading.edge_deviation_px > 3.0) return fail(no_stop);
  profile = profile_of(picture, low, fitted);
  reading.centre_px = fitted.centre;
  reading.radius_px = fitted.radius;
  reading.edge_level = low;
  if (const auto found = find_notch(profile, reading); !found) return tl::unexpected(found.error());
  return reading;
}

}  // namespace perimap
