#include "core/vision/feature_detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <tuple>
#include <utility>

#include "core/vision/image_noise.hpp"
#include "core/vision/opencv_threads.hpp"
#include "core/vision/widened_mask.hpp"

namespace perimap {
namespace {

struct Corner {
  int x;
  int y;
  float strength;
};

// Stronger first; equal ones by place, so that the order is the same everywhere.
bool stronger(const Corner& a, const Corner& b) {
  return std::tuple(-a.strength, a.y, a.x) < std::tuple(-b.strength, b.y, b.x);
}

// What of it is joined to the border: about a round view, and not a shadow within it.
cv::Mat joined_to_border(const cv::Mat& dark) {
  constexpr std::uint8_t kJoined = 128;
  cv::Mat marked = dark.clone();
  const auto mark = [&marked](int x, int y) {
    if (marked.at<std::uint8_t>(y, x) == 255) cv::floodFill(marked, {x, y}, cv::Scalar(kJoined));
  };
  for (int x = 0; x < marked.cols; ++x) {
    mark(x, 0);
    mark(x, marked.rows - 1);
  }
  for (int y = 0; y < marked.rows; ++y) {
    mark(0, y);
    mark(marked.cols - 1, y);
  }
  return marked == kJoined;
}

constexpr int kSurroundWindow_px = 5;

// 255 where no feature may be.
cv::Mat forbidden(const cv::Mat& image, const DetectorSettings& settings) {
  const cv::Mat highlight = widened(image >= settings.highlight_grey, settings.highlight_clearance_px);
  // Averaged, so that a dark vessel or a noisy pixel is not taken for the background.
  cv::Mat mean;
  cv::blur(image, mean, {settings.background_size_px, settings.background_size_px});
  // The mean turns dark only half a window inside the background.
  const double inside_px = 0.5 * settings.background_size_px;
  cv::Mat barred = highlight | widened(mean < settings.background_grey, settings.background_clearance_px + inside_px);
  if (settings.surround_grey < 0) return barred;
  cv::blur(image, mean, {kSurroundWindow_px, kSurroundWindow_px});
  const cv::Mat surround = joined_to_border(mean <= settings.surround_grey);
  return barred | widened(surround, settings.surround_clearance_px + 0.5 * kSurroundWindow_px);
}

// The smaller eigenvalue of the gradient product's mean over a patch, (grey levels / px)^2 (Shi & Tomasi, "Good
// Features to Track", CVPR 1994).
cv::Mat corner_strength(const cv::Mat& image, double min_roundness) {
  constexpr int kPatch = 15;
  constexpr double kSobelGain = 8;
  cv::Mat smooth, gx, gy;
  cv::GaussianBlur(image, smooth, {5, 5}, 1.0);  // else noise counts as texture
  cv::Sobel(smooth, gx, CV_32F, 1, 0, 3, 1 / kSobelGain);
  cv::Sobel(smooth, gy, CV_32F, 0, 1, 3, 1 / kSobelGain);
  cv::Mat xx = gx.mul(gx), xy = gx.mul(gy), yy = gy.mul(gy);
  for (cv::Mat* product : {&xx, &xy, &yy}) cv::blur(*product, *product, {kPatch, kPatch});
  cv::Mat strength(image.size(), CV_32F);
  for (int y = 0; y < strength.rows; ++y) {
    const float* const a = xx.ptr<float>(y);
    const float* const b = xy.ptr<float>(y);
    const float* const c = yy.ptr<float>(y);
    float* const out = strength.ptr<float>(y);
    for (int x = 0; x < strength.cols; ++x) {
      const float mean = 0.5F * (a[x] + c[x]);
      const float spread = std::sqrt(0.25F * (a[x] - c[x]) * (a[x] - c[x]) + b[x] * b[x]);
      const bool is_edge = mean - spread < static_cast<float>(min_roundness) * (mean + spread);
      out[x] = is_edge ? 0.0F : mean - spread;
    }
  }
  return strength;
}

bool is_local_maximum(const cv::Mat& strength, int x, int y) {
  const float here = strength.at<float>(y, x);
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      if (strength.at<float>(v, u) > here) return false;
    }
  }
  return true;
}

// A local maximum has neighbours.
int border_of(const DetectorSettings& settings) { return std::max(settings.border_px, 1); }

// As far as a pixel's verdict looks.
int reach_of(const DetectorSettings& settings) {
  const double furthest =
      std::max({settings.highlight_clearance_px, settings.background_clearance_px + settings.background_size_px,
                settings.surround_clearance_px + kSurroundWindow_px});
  return std::max(border_of(settings), static_cast<int>(std::ceil(furthest)));
}

struct Tile {
  std::vector<Corner> corners;  // strongest first
  std::size_t next = 0;         // the first corner not looked at yet
  int features = 0;             // it holds, old and new

  [[nodiscard]] bool is_spent() const { return next >= corners.size(); }
};

// The emptiest tile whose next corner is the strongest. Null when all are spent.
Tile* neediest(std::vector<Tile>& tiles) {
  Tile* chosen = nullptr;
  for (Tile& tile : tiles) {
    if (tile.is_spent()) continue;
    if (chosen == nullptr || tile.features < chosen->features ||
        (tile.features == chosen->features && stronger(tile.corners[tile.next], chosen->corners[chosen->next]))) {
      chosen = &tile;
    }
  }
  return chosen;
}

// OpenCV takes no const data; what is borrowed here is only read.
cv::Mat borrow(const GreyImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

// In `rows` of the image, which can be a part of one: `taken` may lie outside.
std::vector<Vector2d> find(const cv::Mat& image, std::vector<Vector2d> taken, const DetectorSettings& settings,
                           std::size_t how_many, const cv::Mat& barred, RowRange rows) {
  const cv::Mat strength = corner_strength(image, settings.min_roundness);
  cv::Mat mask = forbidden(image, settings);
  if (!barred.empty()) mask |= barred;
  const int columns = (image.cols + settings.tile_px - 1) / settings.tile_px;
  const int down = (image.rows + settings.tile_px - 1) / settings.tile_px;
  std::vector<Tile> tiles(static_cast<std::size_t>(columns) * static_cast<std::size_t>(down));
  const auto tile_at = [&](int x, int y) -> Tile& {
    return tiles[static_cast<std::size_t>(y / settings.tile_px) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(x / settings.tile_px)];
  };
  const int border = border_of(settings);
  for (int y = rows.begin; y < rows.end; ++y) {
    for (int x = border; x < image.cols - border; ++x) {
      if (mask.at<std::uint8_t>(y, x) != 0 || strength.at<float>(y, x) < settings.min_corner) continue;
      if (is_local_maximum(strength, x, y)) tile_at(x, y).corners.push_back({x, y, strength.at<float>(y, x)});
    }
  }
  for (Tile& tile : tiles) std::sort(tile.corners.begin(), tile.corners.end(), stronger);

  for (const Vector2d& px : taken) {
    if (!(px.x() >= 0 && px.y() >= 0 && px.x() < image.cols && px.y() < image.rows)) continue;
    ++tile_at(static_cast<int>(px.x()), static_cast<int>(px.y())).features;
  }
  std::vector<Vector2d> found;
  const double min_squared = settings.min_distance_px * settings.min_distance_px;
  while (found.size() < how_many) {
    Tile* const tile = neediest(tiles);
    if (tile == nullptr) break;
    const Corner& corner = tile->corners[tile->next++];
    const Vector2d px(corner.x, corner.y);
    const auto is_near = [&](const Vector2d& other) { return (other - px).squaredNorm() < min_squared; };
    if (std::any_of(taken.begin(), taken.end(), is_near)) continue;
    taken.push_back(px);
    found.push_back(px);
    ++tile->features;
  }
  return found;
}

}  // namespace

DetectorSettings detector_settings_for(int width, int height, double noise, int how_many,
                                       const PictureLight& light) noexcept {
  DetectorSettings settings;
  const double brightness = std::min(light.lit_grey / PictureLight::kUsual_grey, 1.0);
  // Noise of sigma alone gives a corner 0.19 sigma^2 (patch_template.hpp); rounding to whole grey levels is noise too.
  constexpr double kLeastCorner = 0.5, kLeastCornerOfRounding = 0.12;
  const double least = std::max(kLeastCorner * brightness * brightness, kLeastCornerOfRounding);
  settings.min_corner = std::clamp(1.2 * noise * noise, least, DetectorSettings{}.min_corner);
  constexpr double kLeastBackground_grey = 2, kSurroundMargin_grey = 5;
  double background = std::max(kLeastBackground_grey, brightness * settings.background_grey);
  if (light.surround_grey > 0) {
    background = std::max(background, std::min(light.surround_grey + kSurroundMargin_grey, 0.5 * light.lit_grey));
  }
  settings.background_grey = static_cast<int>(std::lround(background));
  constexpr int kBelowWhite_grey = 10;
  settings.highlight_grey = light.white_grey - kBelowWhite_grey;
  const double spacing = std::sqrt(static_cast<double>(width) * height / std::max(how_many, 1));
  constexpr double kRoundness = 0.1;
  settings.min_roundness = kRoundness;
  settings.tile_px = std::clamp(static_cast<int>(0.6 * spacing), 16, 400);
  settings.min_distance_px = std::clamp(0.4 * spacing, 10.0, 60.0);
  return settings;
}

namespace {

DetectorSettings settings_by(const GreyImage& image, const PictureLight& light, int how_many) {
  // In a dim picture hardly anything is above the grey that counts as dark elsewhere.
  const int dark_grey = std::min(kDark_grey, static_cast<int>(0.5 * light.lit_grey));
  return detector_settings_for(image.width, image.height, estimate_noise(image, dark_grey), how_many, light);
}

}  // namespace

DetectorSettings detector_settings_for(const GreyImage& image, int how_many) {
  return settings_by(image, estimate_light(image), how_many);
}

DetectorSettings detector_settings_for_trial(const GreyImage& image, int how_many) {
  const PictureLight light = estimate_light(image);
  DetectorSettings settings = settings_by(image, light, how_many);
  // A template of level 0 fits with its gradients; coarser ones are done without where they do not.
  settings.border_px = PatchTemplate::kReach + 2;
  constexpr double kShareOfCorner = 0.1, kRoundness = 0.03, kWidth = 1280, kSmallest = 0.25;
  settings.min_corner *= kShareOfCorner;
  settings.min_roundness = kRoundness;
  const double scale = std::clamp(image.width / kWidth, kSmallest, 1.0);
  settings.highlight_clearance_px *= scale;
  settings.background_clearance_px *= scale;
  if (light.has_surround) {
    // A surround shows how dark it is where nothing is seen: what is a little brighter is dim tissue.
    constexpr int kSurroundMargin_grey = 3;
    settings.surround_grey = settings.background_grey =
        static_cast<int>(std::lround(light.surround_grey)) + kSurroundMargin_grey;
  }
  const double spacing = std::sqrt(static_cast<double>(image.width) * image.height / std::max(how_many, 1));
  constexpr double kOfSpacing = 0.3, kLeast_px = 5, kMost_px = 40;
  settings.min_distance_px = std::clamp(kOfSpacing * spacing, kLeast_px, kMost_px);
  return settings;
}

TemplateSettings template_settings_for(const DetectorSettings& settings) noexcept {
  TemplateSettings of_templates;
  of_templates.min_texture = 0.8 * settings.min_corner;
  of_templates.min_texture_coarse = 0.3 * settings.min_corner;
  // One that only just counts as a highlight is not clipped yet.
  constexpr int kClippedAbove_grey = 5;
  of_templates.saturated_grey = settings.highlight_grey + kClippedAbove_grey;
  return of_templates;
}

int bands_of(int width, int height) noexcept {
  constexpr std::int64_t kBand_pixels = 640 * 480;
  const std::int64_t pixels = std::int64_t{width} * height;
  return static_cast<int>(std::max<std::int64_t>((pixels + kBand_pixels - 1) / kBand_pixels, 1));
}

RowRange rows_of_band(int height, int band, int bands) noexcept {
  return {band * height / bands, (band + 1) * height / bands};
}

int band_of_row(int height, int row, int bands) noexcept {
  return std::clamp(((row + 1) * bands - 1) / std::max(height, 1), 0, bands - 1);
}

Expected<std::vector<Vector2d>> find_features(const GreyImage& image, std::span<const Vector2d> occupied,
                                              const DetectorSettings& settings, int how_many, const GreyImage& barred,
                                              RowRange rows) {
  if (image.data == nullptr || image.width < 1 || image.height < 1 || image.stride < image.width) {
    return fail("feature detector: image of " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                " with stride " + std::to_string(image.stride) + " cannot be read");
  }
  if (settings.tile_px < 1 || settings.background_size_px < 1 || !(settings.min_distance_px >= 0)) {
    return fail("feature detector: tile_px, background_size_px and min_distance_px must be positive");
  }
  if (how_many <= 0) return std::vector<Vector2d>{};
  const int border = border_of(settings), reach = reach_of(settings);
  const RowRange searched{std::max(rows.begin, border), std::min(rows.end, image.height - border)};
  if (searched.end <= searched.begin) return std::vector<Vector2d>{};
  const int first = std::max(searched.begin - reach, 0), last = std::min(searched.end + reach, image.height);
  const auto band_of = [&](const GreyImage& whole) {
    return GreyImage{whole.row(first), whole.width, last - first, whole.stride};
  };
  const bool bars = barred.data != nullptr && barred.width == image.width && barred.height == image.height;
  try {
    keep_opencv_to_one_thread();
    const Vector2d origin(0, first);
    std::vector<Vector2d> taken(occupied.begin(), occupied.end());
    for (Vector2d& px : taken) px -= origin;
    std::vector<Vector2d> found =
        find(borrow(band_of(image)), std::move(taken), settings, static_cast<std::size_t>(how_many),
             bars ? borrow(band_of(barred)) : cv::Mat(), {searched.begin - first, searched.end - first});
    for (Vector2d& px : found) px += origin;
    return found;
  } catch (const std::exception& error) {
    std::string what = error.what();
    std::replace(what.begin(), what.end(), '\n', ' ');
    return fail("feature detector: " + what);
  }
}

}  // namespace perimap
