#include "tests/simulated/picture_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "core/vision/image_noise.hpp"
#include "core/vision/picture_light.hpp"

namespace perimap {
namespace {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

std::vector<double> levels_of(const cv::Mat& picture, const cv::Mat& usable) {
  std::vector<double> levels;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (usable.at<std::uint8_t>(y, x) != 0) levels.push_back(picture.at<std::uint8_t>(y, x));
    }
  }
  return levels;
}

// As estimate_noise(), of what lies between two levels.
double noise_between(const cv::Mat& picture, const cv::Mat& usable, double low, double high) {
  constexpr float kWeights[9] = {1, -2, 1, -2, 4, -2, 1, -2, 1};
  cv::Mat off, level;
  cv::filter2D(picture, off, CV_32F, cv::Mat(3, 3, CV_32F, const_cast<float*>(kWeights)));
  cv::blur(picture, level, {5, 5});
  std::vector<double> sizes;
  for (int y = 1; y + 1 < picture.rows; ++y) {
    for (int x = 1; x + 1 < picture.cols; ++x) {
      const double at = level.at<std::uint8_t>(y, x);
      if (usable.at<std::uint8_t>(y, x) == 0 || at < low || at > high) continue;
      sizes.push_back(std::abs(off.at<float>(y, x)));
    }
  }
  constexpr std::size_t kFew = 400;
  if (sizes.size() < kFew) return 0;
  // The sums are whole numbers: the median within its own bin, evenly.
  const double median = quantile(sizes, 0.5);
  double below = 0, within = 0;
  for (const double size : sizes) {
    below += size < median ? 1 : 0;
    within += size == median ? 1 : 0;
  }
  constexpr double kMedianOfNormal = 0.6745, kGain = 6;
  return (median - 0.5 + (0.5 * static_cast<double>(sizes.size()) - below) / within) / (kMedianOfNormal * kGain);
}

double blockiness(const cv::Mat& picture, const cv::Mat& usable) {
  constexpr int kBlock = 8;
  double across = 0, within = 0, n_across = 0, n_within = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 1; x < picture.cols; ++x) {
      if (usable.at<std::uint8_t>(y, x) == 0) continue;
      const double step = std::abs(picture.at<std::uint8_t>(y, x) - picture.at<std::uint8_t>(y, x - 1));
      (x % kBlock == 0 ? across : within) += step;
      (x % kBlock == 0 ? n_across : n_within) += 1;
    }
  }
  return within > 0 && n_across > 0 ? across / n_across / (within / n_within) : 1;
}

// Corners, followed there and back; those that are lost are left out of both.
void follow(const cv::Mat& from, const cv::Mat& to, std::vector<cv::Point2f>& begun, std::vector<cv::Point2f>& ended) {
  if (begun.empty()) return;
  std::vector<cv::Point2f> there, back;
  std::vector<std::uint8_t> found, found_back;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from, to, ended, there, found, error);
  cv::calcOpticalFlowPyrLK(to, from, there, back, found_back, error);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ended.size(); ++i) {
    if (found[i] == 0 || found_back[i] == 0 || cv::norm(back[i] - ended[i]) > 1) continue;
    begun[kept] = begun[i];
    ended[kept++] = there[i];
  }
  begun.resize(kept);
  ended.resize(kept);
}

std::vector<cv::Point2f> corners_of(const cv::Mat& picture, const cv::Mat& usable) {
  constexpr int kMost = 150;
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(picture, corners, kMost, 0.01, 10, usable);
  return corners;
}

}  // namespace

const std::vector<NamedStatistic>& named_statistics() {
  using S = PictureStatistics;
  static const std::vector<NamedStatistic> names{{"lit", &S::lit_grey, 0},
                                                 {"spread", &S::spread, 2},
                                                 {"noise", &S::noise, 2},
                                                 {"noise, dim", &S::noise_dim, 2},
                                                 {"noise, bright", &S::noise_bright, 2},
                                                 {"gradient", &S::gradient, 2},
                                                 {"fine/coarse", &S::fine_over_coarse, 2},
                                                 {"blocks", &S::blocks, 2},
                                                 {"corner, weak", &S::corner_weak, 2},
                                                 {"corner, middle", &S::corner_middle, 1},
                                                 {"corner, strong", &S::corner_strong, 1},
                                                 {"highlights %", &S::highlights_percent, 2},
                                                 {"one, permille", &S::highlight_permille, 3},
                                                 {"highlights", &S::highlights, 1},
                                                 {"changed", &S::highlights_changed, 2},
                                                 {"their speed", &S::highlight_speed, 1},
                                                 {"gain %", &S::gain_percent, 1},
                                                 {"bias", &S::bias_grey, 1},
                                                 {"correlation", &S::kept_correlation, 3},
                                                 {"correlation, tenth", &S::kept_correlation_tenth, 3},
                                                 {"followed", &S::followed, 2},
                                                 {"speed", &S::speed, 1}};
  return names;
}

void PictureWatch::look_at(const GreyImage& given) {
  const cv::Mat picture = cv::Mat(given.height, given.width, CV_8UC1, const_cast<std::uint8_t*>(given.data),
                                  static_cast<std::size_t>(given.stride))
                              .clone();
  const PictureLight light = estimate_light(given);
  constexpr int kBelowWhite = 10;
  const cv::Mat bright = picture >= light.white_grey - kBelowWhite;
  cv::Mat usable;
  cv::dilate(bright, usable, cv::getStructuringElement(cv::MORPH_RECT, {15, 15}));
  usable = ~usable & (picture > 0.3 * light.lit_grey);

  of_pictures_.emplace_back();
  of_pictures_.back().lit_grey = light.lit_grey;
  of_pictures_.back().noise = estimate_noise(given);
  look_at_texture(picture, usable);
  pictures_.push_back(picture);
  usable_.push_back(usable);
  look_at_highlights(picture, bright);
  const auto followed = static_cast<std::size_t>(std::lround(PictureStatistics::kFollowed_s * frames_per_s_));
  if (pictures_.size() <= std::max<std::size_t>(followed, 1)) return;
  look_at_change(pictures_.front(), usable_.front(), picture);
  pictures_.erase(pictures_.begin());
  usable_.erase(usable_.begin());
}

void PictureWatch::look_at_texture(const cv::Mat& picture, const cv::Mat& usable) {
  PictureStatistics& now = of_pictures_.back();
  const std::vector<double> levels = levels_of(picture, usable);
  now.spread = (quantile(levels, 0.9) - quantile(levels, 0.1)) / std::max(now.lit_grey, 1.0);
  constexpr double kDim = 80, kBright = 120, kClipped = 240;
  now.noise_dim = noise_between(picture, usable, 0, kDim);
  now.noise_bright = noise_between(picture, usable, kBright, kClipped);
  cv::Mat smooth, smoother, gx, gy, wide_x, wide_y;
  constexpr double kSobel = 1.0 / 8;
  cv::GaussianBlur(picture, smooth, {5, 5}, 1.0);
  cv::GaussianBlur(picture, smoother, {}, 3.0);
  cv::Sobel(smooth, gx, CV_32F, 1, 0, 3, kSobel);
  cv::Sobel(smooth, gy, CV_32F, 0, 1, 3, kSobel);
  cv::Sobel(smoother, wide_x, CV_32F, 1, 0, 3, kSobel);
  cv::Sobel(smoother, wide_y, CV_32F, 0, 1, 3, kSobel);
  const double energy = cv::mean(gx.mul(gx) + gy.mul(gy), usable)[0];
  const double wide = cv::mean(wide_x.mul(wide_x) + wide_y.mul(wide_y), usable)[0];
  now.gradient = std::sqrt(energy);
  now.fine_over_coarse = wide > 0 ? std::sqrt(energy / wide) : 0;
  now.blocks = blockiness(picture, usable);
  look_at_corners(gx, gy, usable);
}

void PictureWatch::look_at_corners(const cv::Mat& gx, const cv::Mat& gy, const cv::Mat& usable) {
  constexpr int kPatch = 15;
  cv::Mat xx, xy, yy;
  cv::blur(gx.mul(gx), xx, {kPatch, kPatch});
  cv::blur(gx.mul(gy), xy, {kPatch, kPatch});
  cv::blur(gy.mul(gy), yy, {kPatch, kPatch});
  const int side = std::max(kPatch, gx.cols / 16);
  std::vector<double> best;
  for (int top = 0; top + side <= gx.rows; top += side) {
    for (int left = 0; left + side <= gx.cols; left += side) {
      double strongest = 0;
      int seen = 0;
      for (int y = top; y < top + side; ++y) {
        for (int x = left; x < left + side; ++x) {
          if (usable.at<std::uint8_t>(y, x) == 0) continue;
          ++seen;
          const double a = xx.at<float>(y, x), b = xy.at<float>(y, x), c = yy.at<float>(y, x);
          strongest = std::max(strongest, 0.5 * (a + c) - std::sqrt(0.25 * (a - c) * (a - c) + b * b));
        }
      }
      if (2 * seen > side * side) best.push_back(strongest);
    }
  }
  PictureStatistics& now = of_pictures_.back();
  now.corner_weak = quantile(best, 0.25);
  now.corner_middle = quantile(best, 0.5);
  now.corner_strong = quantile(best, 0.75);
}

void PictureWatch::look_at_highlights(const cv::Mat& picture, const cv::Mat& bright) {
  PictureStatistics& now = of_pictures_.back();
  cv::Mat labels, about, centres;
  const int count = cv::connectedComponentsWithStats(bright, labels, about, centres);
  std::vector<Spot> spots;
  std::vector<double> areas;
  constexpr int kLeast_px = 3;
  for (int label = 1; label < count; ++label) {
    const int area = about.at<int>(label, cv::CC_STAT_AREA);
    if (area < kLeast_px) continue;
    spots.push_back({{centres.at<double>(label, 0), centres.at<double>(label, 1)}, area});
    areas.push_back(1000.0 * area / static_cast<double>(picture.total()));
  }
  now.highlights_percent = 100.0 * cv::countNonZero(bright) / static_cast<double>(picture.total());
  now.highlight_permille = quantile(areas, 0.5);
  now.highlights = static_cast<double>(spots.size());
  if (pictures_.size() >= 2) {
    const double either = cv::countNonZero(bright | bright_before_);
    if (either > 0) highlights_changed_.push_back(cv::countNonZero(bright ^ bright_before_) / either);
    const double to_speed = 100.0 * frames_per_s_ / picture.cols;
    const cv::Mat& before = pictures_[pictures_.size() - 2];
    for (const Spot& spot : spots) {
      // The one before that is about as large and lies nearest to where the tissue around it has come from.
      const auto flow = tissue_flow_at(spot.centre, picture, before);
      if (!flow) continue;
      double nearest = 0.03 * picture.cols;
      bool seen = false;
      for (const Spot& other : spots_before_) {
        if (2 * spot.area < other.area || spot.area > 2 * other.area) continue;
        const double off = cv::norm(other.centre - spot.centre - *flow);
        seen = seen || off < nearest;
        nearest = std::min(nearest, off);
      }
      if (seen) highlight_speed_.push_back(to_speed * nearest);
    }
  }
  bright_before_ = bright.clone();
  spots_before_ = std::move(spots);
}

// The middle one of what surrounds the place at some distance; none: little is found there.
std::optional<cv::Point2d> PictureWatch::tissue_flow_at(const cv::Point2d& place, const cv::Mat& from,
                                                        const cv::Mat& to) const {
  constexpr int kAround = 8;
  std::vector<cv::Point2f> begun, ended;
  const double radius = 0.06 * from.cols;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * CV_PI * i / kAround;
    const cv::Point2f at(static_cast<float>(place.x + radius * std::cos(angle)),
                         static_cast<float>(place.y + radius * std::sin(angle)));
    if (at.x < 1 || at.y < 1 || at.x > static_cast<float>(from.cols - 2) || at.y > static_cast<float>(from.rows - 2)) {
      continue;
    }
    begun.push_back(at);
  }
  ended = begun;
  follow(from, to, begun, ended);
  if (2 * begun.size() < kAround) return std::nullopt;
  std::vector<double> x, y;
  for (std::size_t i = 0; i < begun.size(); ++i) {
    x.push_back(ended[i].x - begun[i].x);
    y.push_back(ended[i].y - begun[i].y);
  }
  return cv::Point2d(quantile(x, 0.5), quantile(y, 0.5));
}

void PictureWatch::look_at_change(const cv::Mat& from, const cv::Mat& usable, const cv::Mat& to) {
  std::vector<cv::Point2f> begun = corners_of(from, usable);
  if (begun.empty()) return;
  const auto corners = static_cast<double>(begun.size());
  std::vector<cv::Point2f> ended = begun;
  for (std::size_t i = 0; i + 1 < pictures_.size(); ++i) follow(pictures_[i], pictures_[i + 1], begun, ended);
  followed_.push_back(static_cast<double>(begun.size()) / corners);
  constexpr int kWindow = 21;
  const double seconds = static_cast<double>(pictures_.size() - 1) / frames_per_s_;
  for (std::size_t i = 0; i < begun.size(); ++i) {
    cv::Mat before, after, correlation;
    cv::getRectSubPix(from, {kWindow, kWindow}, begun[i], before, CV_32F);
    cv::getRectSubPix(to, {kWindow, kWindow}, ended[i], after, CV_32F);
    cv::Scalar mean_before, mean_after, spread_before, spread_after;
    cv::meanStdDev(before, mean_before, spread_before);
    cv::meanStdDev(after, mean_after, spread_after);
    if (spread_before[0] < 1 || spread_after[0] < 1) continue;
    cv::matchTemplate(before, after, correlation, cv::TM_CCOEFF_NORMED);
    gain_.push_back(100 * std::log(spread_after[0] / spread_before[0]));
    bias_.push_back(mean_after[0] - mean_before[0]);
    correlation_.push_back(correlation.at<float>(0, 0));
    speed_.push_back(100 * cv::norm(ended[i] - begun[i]) / from.cols / seconds);
  }
}

PictureStatistics PictureWatch::statistics() const {
  PictureStatistics all;
  for (const NamedStatistic& statistic : named_statistics()) {
    std::vector<double> values;
    for (const PictureStatistics& one : of_pictures_) {
      values.push_back(one.*statistic.value);
    }
    all.*statistic.value = mean(values);
  }
  // A level that a picture has too little of tells nothing.
  const auto of_those_with = [&](double PictureStatistics::*value) {
    std::vector<double> values;
    for (const PictureStatistics& one : of_pictures_) {
      if (one.*value > 0) values.push_back(one.*value);
    }
    return mean(values);
  };
  all.noise_dim = of_those_with(&PictureStatistics::noise_dim);
  all.noise_bright = of_those_with(&PictureStatistics::noise_bright);
  all.highlight_permille = of_those_with(&PictureStatistics::highlight_permille);
  all.highlights_changed = mean(highlights_changed_);
  all.highlight_speed = quantile(highlight_speed_, 0.5);
  all.gain_percent = root_mean_square(gain_);
  all.bias_grey = root_mean_square(bias_);
  all.kept_correlation = quantile(correlation_, 0.5);
  all.kept_correlation_tenth = quantile(correlation_, 0.1);
  all.followed = mean(followed_);
  all.speed = quantile(speed_, 0.5);
  return all;
}

}  // namespace perimap
