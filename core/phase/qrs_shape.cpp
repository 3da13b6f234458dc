#include "core/phase/qrs_shape.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kKeep = 0.99;  // of a template's weight from beat to beat: some 100 beats count
constexpr double kSame = 0.85;  // correlation from which on a beat is of a template's kind
constexpr double kSlowestLearning = 1.0 / 8.0;
constexpr int kDisplaced = 3;  // steps, 15 ms

ShapeMatch match_displaced(const QrsShape& shape, const QrsShape& reference, int displaced) noexcept {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  const int first = std::max(0, -displaced);
  const int last = std::min(shape.points, shape.points - displaced);
  for (int i = first; i < last; ++i) {
    const double x = static_cast<double>(shape.slope[static_cast<std::size_t>(i + displaced)]);
    const double y = static_cast<double>(reference.slope[static_cast<std::size_t>(i)]);
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  if (!(xx > 0.0) || !(yy > 0.0)) return {};
  return {xy / std::sqrt(xx * yy), xy / yy, displaced};
}

}  // namespace

double root_mean_square(const QrsShape& shape) noexcept {
  double sum = 0.0;
  for (int i = 0; i < shape.points; ++i) {
    const double slope = static_cast<double>(shape.slope[static_cast<std::size_t>(i)]);
    sum += slope * slope;
  }
  return std::sqrt(sum / std::max(shape.points, 1));
}

ShapeMatch match(const QrsShape& shape, const QrsShape& reference) noexcept { return best_match(shape, reference, 0); }

ShapeMatch best_match(const QrsShape& shape, const QrsShape& reference, int most_displaced) noexcept {
  if (shape.points == 0 || shape.points != reference.points) return {};
  ShapeMatch best = match_displaced(shape, reference, 0);
  for (int k = 1; k <= most_displaced; ++k) {
    for (const int displaced : {-k, k}) {
      const ShapeMatch other = match_displaced(shape, reference, displaced);
      if (other.correlation > best.correlation) best = other;
    }
  }
  return best;
}

int ShapeTemplates::heaviest() const noexcept {
  const auto heaviest = std::max_element(templates_.begin(), templates_.end(),
                                         [](const Template& a, const Template& b) { return a.weight < b.weight; });
  return heaviest->weight > 0.0 ? static_cast<int>(heaviest - templates_.begin()) : -1;
}

int ShapeTemplates::kind_of(const QrsShape& shape) const noexcept {
  int best = -1;
  double correlation = kSame;
  for (int i = 0; i < kTemplates; ++i) {
    if (of(i).weight == 0.0) continue;
    const double c = best_match(shape, of(i).shape, kDisplaced).correlation;
    if (c < correlation) continue;
    correlation = c;
    best = i;
  }
  return best;
}

int ShapeTemplates::learn(const QrsShape& shape) noexcept {
  const double size = root_mean_square(shape);
  if (!(size > 0.0)) return -1;
  for (Template& t : templates_) t.weight *= kKeep;
  int best = kind_of(shape);
  if (best < 0) {
    const auto rarest = std::min_element(templates_.begin(), templates_.end(),
                                         [](const Template& a, const Template& b) { return a.weight < b.weight; });
    *rarest = {};
    rarest->shape.points = shape.points;
    best = static_cast<int>(rarest - templates_.begin());
  }
  Template& t = templates_[static_cast<std::size_t>(best)];
  t.weight += 1.0;
  const auto rate = static_cast<float>(std::max(1.0 / t.weight, kSlowestLearning));
  for (int i = 0; i < shape.points; ++i) {
    float& mean = t.shape.slope[static_cast<std::size_t>(i)];
    mean += rate * (shape.slope[static_cast<std::size_t>(i)] / static_cast<float>(size) - mean);
  }
  const auto norm = static_cast<float>(root_mean_square(t.shape));
  for (float& slope : t.shape.slope) slope /= norm;
  return best;
}

}  // namespace perimap
