#include "core/phase/qrs_shape.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kKeep = 0.99;         // of a template's weight from beat to beat: some 100 beats count
constexpr double kSmallest = 0.25;     // of the largest template's amplitude
constexpr double kEstablished = 0.12;
constexpr double kSlowestLearning = 1.0 / 8.0;
constexpr int kDisplaced = 3;          // steps, 15 ms

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
  return {xy / std::sqrt(xx * yy), xy / yy};
}

double amplitude(const QrsShape& shape) noexcept {
  double sum = 0.0;
  for (int i = 0; i < shape.points; ++i) {
    const double slope = static_cast<double>(shape.slope[static_cast<std::size_t>(i)]);
    sum += slope * slope;
  }
  return std::sqrt(sum / std::max(shape.points, 1));
}

}  // namespace

ShapeMatch match(const QrsShape& shape, const QrsShape& reference) noexcept {
  return best_match(shape, reference, 0);
}

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

void ShapeTemplates::clear() noexcept { templates_.fill({}); }

int ShapeTemplates::learn(const QrsShape& shape, bool upward) noexcept {
  if (shape.points == 0) return -1;
  for (Template& t : templates_) t.weight *= kKeep;
  int best = -1;
  double correlation = kSame;
  for (int i = 0; i < kTemplates; ++i) {
    const Template& t = (*this)[i];
    if (t.weight == 0.0) continue;
    const double c = best_match(shape, t.shape, kDisplaced).correlation;
    if (c >= correlation) {
      correlation = c;
      best = i;
    }
  }
  if (best < 0) {
    const auto rarest = std::min_element(templates_.begin(), templates_.end(),
                                         [](const Template& a, const Template& b) { return a.weight < b.weight; });
    *rarest = {shape, 1.0, amplitude(shape), upward};
    return static_cast<int>(rarest - templates_.begin());
  }
  Template& t = templates_[static_cast<std::size_t>(best)];
  t.weight += 1.0;
  const auto rate = static_cast<float>(std::max(1.0 / t.weight, kSlowestLearning));
  for (int i = 0; i < shape.points; ++i) {
    float& mean = t.shape.slope[static_cast<std::size_t>(i)];
    mean += rate * (shape.slope[static_cast<std::size_t>(i)] - mean);
  }
  t.amplitude = amplitude(t.shape);
  return best;
}

void ShapeTemplates::scale(double factor) noexcept {
  for (Template& t : templates_) {
    for (float& slope : t.shape.slope) slope *= static_cast<float>(factor);
    t.amplitude *= factor;
  }
}

bool ShapeTemplates::any_trusted() const noexcept {
  return std::any_of(templates_.begin(), templates_.end(), [](const Template& t) { return t.trusted(); });
}

bool ShapeTemplates::usable(int i) const noexcept {
  double largest = 0.0;
  for (const Template& t : templates_) {
    if (t.trusted()) largest = std::max(largest, t.amplitude);
  }
  return (*this)[i].trusted() && (*this)[i].amplitude > kSmallest * largest;
}

bool ShapeTemplates::established(int i) const noexcept {
  if (i < 0 || !usable(i)) return false;
  double total = 0.0;
  for (const Template& t : templates_) total += t.weight;
  return (*this)[i].weight >= kEstablished * total;
}

int ShapeTemplates::heaviest() const noexcept {
  const auto heaviest = std::max_element(templates_.begin(), templates_.end(),
                                         [](const Template& a, const Template& b) { return a.weight < b.weight; });
  return heaviest->weight > 0.0 ? static_cast<int>(heaviest - templates_.begin()) : -1;
}

}  // namespace perimap
