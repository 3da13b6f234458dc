#include "core/following/seen_places.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

// Zero-mean normalised, of what both show where the second is displaced so.
double correlation_at(const Thumbnail& before, const Thumbnail& now, int dx, int dy) noexcept {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0, count = 0;
  for (int y = std::max(0, dy); y < std::min(now.height, now.height + dy); ++y) {
    for (int x = std::max(0, dx); x < std::min(now.width, now.width + dx); ++x) {
      const double p = before.at(x - dx, y - dy), q = now.at(x, y);
      a += p;
      b += q;
      aa += p * p;
      bb += q * q;
      ab += p * q;
      ++count;
    }
  }
  const double spread = (aa - a * a / count) * (bb - b * b / count);
  return spread > 0 ? (ab - a * b / count) / std::sqrt(spread) : 0;
}

void leave_what_differs(Thumbnail& small) noexcept {
  constexpr int kAround = 5;
  const auto given = small.grey;
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      float sum = 0;
      int count = 0;
      for (int v = std::max(0, y - kAround); v <= std::min(small.height - 1, y + kAround); ++v) {
        for (int u = std::max(0, x - kAround); u <= std::min(small.width - 1, x + kAround); ++u, ++count) {
          sum += given[static_cast<std::size_t>(v * small.width + u)];
        }
      }
      small.grey[static_cast<std::size_t>(y * small.width + x)] -= sum / static_cast<float>(count);
    }
  }
}

}  // namespace

Thumbnail thumbnail_of(const GreyImage& image) noexcept {
  Thumbnail small;
  small.scale = std::max(1.0, static_cast<double>(std::max(image.width, image.height)) / Thumbnail::kSide);
  small.width = std::clamp(static_cast<int>(image.width / small.scale), 1, Thumbnail::kSide);
  small.height = std::clamp(static_cast<int>(image.height / small.scale), 1, Thumbnail::kSide);
  constexpr int kSamples = 4;  // a side
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      float sum = 0;
      for (int v = 0; v < kSamples; ++v) {
        const int row = static_cast<int>((y + (v + 0.5) / kSamples) * small.scale);
        for (int u = 0; u < kSamples; ++u) {
          const int column = static_cast<int>((x + (u + 0.5) / kSamples) * small.scale);
          sum += static_cast<float>(image.row(std::min(row, image.height - 1))[std::min(column, image.width - 1)]);
        }
      }
      small.grey[static_cast<std::size_t>(y * small.width + x)] = sum / (kSamples * kSamples);
    }
  }
  leave_what_differs(small);
  return small;
}

std::optional<Vector2d> displacement_between(const Thumbnail& before, const Thumbnail& now) noexcept {
  constexpr int kReach = 3;  // one in so many of a side
  constexpr double kAlike = 0.5;
  if (before.width != now.width || before.height != now.height) return std::nullopt;
  double best = kAlike;
  std::optional<Vector2d> displacement;
  for (int dy = -now.height / kReach; dy <= now.height / kReach; ++dy) {
    for (int dx = -now.width / kReach; dx <= now.width / kReach; ++dx) {
      const double correlation = correlation_at(before, now, dx, dy);
      if (correlation <= best) continue;
      best = correlation;
      displacement = now.scale * Vector2d(dx, dy);
    }
  }
  return displacement;
}

}  // namespace perimap
