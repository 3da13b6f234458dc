#include "daemon/evaluation/track_judge/disturbance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace perimap {
namespace {

// 0 at the beginning and the end, 1 between, with slopes of this share of the time.
double rise_and_fall(double progress, double share) {
  return std::clamp(std::min(progress, 1 - progress) / share, 0.0, 1.0);
}

void bleed(cv::Mat& picture, double progress) {
  constexpr double kOpacity = 0.95, kSlope = 0.3;
  const double size = rise_and_fall(progress, kSlope);
  cv::Mat cover(picture.size(), CV_32F, cv::Scalar(0));
  // From three places on the left, so that about a third is covered.
  for (int i = 0; i < 3; ++i) {
    const cv::Point at(picture.cols * (10 + 7 * i) / 100, picture.rows * (20 + 30 * i) / 100);
    const int radius = static_cast<int>(size * 0.28 * picture.rows);
    if (radius > 0) cv::circle(cover, at, radius, cv::Scalar(kOpacity), cv::FILLED, cv::LINE_8);
  }
  cv::GaussianBlur(cover, cover, {}, std::max(1.0, 0.004 * picture.cols));
  const cv::Vec3f blood(28, 24, 125);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const float opacity = cover.at<float>(y, x);
      auto& pixel = picture.at<cv::Vec3f>(y, x);
      pixel = (1 - opacity) * pixel + opacity * blood;
    }
  }
}

void fog(cv::Mat& picture, double progress) {
  constexpr double kDensest = 0.85, kSlope = 0.35, kGrey = 190;
  const double density = kDensest * rise_and_fall(progress, kSlope);
  const double blur_px = 0.003 * picture.cols * density;
  if (blur_px > 0.3) cv::GaussianBlur(picture, picture, {}, blur_px);
  picture = (1 - density) * picture + cv::Scalar::all(density * kGrey);
}

void wipe(cv::Mat& picture, double progress) {
  constexpr double kSlope = 0.15;
  const double share = rise_and_fall(progress, kSlope);
  cv::GaussianBlur(picture, picture, {}, 0.5 + 0.03 * picture.cols * share);
  const int shift = static_cast<int>(0.2 * picture.cols * std::sin(3 * std::numbers::pi * progress) * share);
  cv::Mat moved;
  const cv::Matx23f by(1, 0, static_cast<float>(shift), 0, 1, static_cast<float>(0.5 * shift));
  cv::warpAffine(picture, moved, by, picture.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  picture = (1 + 0.3 * share) * moved;
}

// Grey and blue, with edges everywhere, and it moves; black on the way out and in, in the trocar.
void show_room(cv::Mat& picture, double progress) {
  constexpr double kTrocar = 0.06;
  if (progress < kTrocar || progress > 1 - kTrocar) {
    picture = cv::Scalar::all(3);
    return;
  }
  cv::RNG random(20);
  const double scale = picture.cols / 256.0;
  picture = cv::Scalar(120, 105, 95);
  for (int i = 0; i < 90; ++i) {
    const cv::Point2d at(random.uniform(-0.5, 1.5) * picture.cols + 0.4 * picture.cols * std::sin(5 * progress),
                         random.uniform(-0.2, 1.2) * picture.rows + 0.2 * picture.rows * std::cos(4 * progress));
    const cv::Size2d size(random.uniform(4.0, 40.0) * scale, random.uniform(4.0, 40.0) * scale);
    const double grey = random.uniform(40.0, 230.0);
    cv::rectangle(picture, cv::Rect2d(at, size), cv::Scalar(grey, 0.95 * grey, 0.9 * grey), cv::FILLED);
  }
  cv::GaussianBlur(picture, picture, {}, scale);
}

void expose(cv::Mat& picture) {
  constexpr double kBlue = 1.9, kGreen = 1.6, kRed = 1.35;
  cv::multiply(picture, cv::Scalar(kBlue, kGreen, kRed), picture);
}

}  // namespace

std::string_view name_of(Disturbance disturbance) noexcept {
  constexpr std::array<std::string_view, kDisturbances.size()> kNames = {"blood", "fog", "wiping", "withdrawn",
                                                                         "exposure"};
  return kNames[static_cast<std::size_t>(disturbance)];
}

double seconds_of(Disturbance disturbance) noexcept {
  constexpr std::array<double, kDisturbances.size()> kSeconds = {2.4, 2.4, 0.8, 5.0, 1.2};
  return kSeconds[static_cast<std::size_t>(disturbance)];
}

Vector2d displacement_after(Disturbance disturbance, int width, int height) noexcept {
  constexpr double kShare = 0.05;
  if (disturbance != Disturbance::kWithdrawn) return Vector2d::Zero();
  return {std::round(kShare * width), std::round(-kShare * height)};
}

VideoFrame DisturbedFrame::compose(const VideoFrame& frame, Disturbance disturbance, double progress) {
  const int width = frame.grey.width, height = frame.grey.height;
  const bool is_over = progress >= 1, happens = progress >= 0 && !is_over;
  const cv::Mat given(height, width, CV_8UC3, const_cast<std::uint8_t*>(frame.colour.bgr),
                      static_cast<std::size_t>(frame.colour.stride));
  cv::Mat picture;
  given.convertTo(picture, CV_32FC3);
  if (happens && disturbance == Disturbance::kBlood) bleed(picture, progress);
  if (happens && disturbance == Disturbance::kFog) fog(picture, progress);
  if (happens && disturbance == Disturbance::kWiping) wipe(picture, progress);
  if (happens && disturbance == Disturbance::kWithdrawn) show_room(picture, progress);
  if (happens && disturbance == Disturbance::kExposure) expose(picture);
  if (is_over) {
    const Vector2d by = displacement_after(disturbance, width, height);
    const cv::Matx23d shift(1, 0, by.x(), 0, 1, by.y());
    if (by.norm() > 0) {
      cv::Mat moved;
      cv::warpAffine(picture, moved, shift, picture.size(), cv::INTER_NEAREST, cv::BORDER_REPLICATE);
      picture = moved;
    }
  }
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  bgr_.resize(3 * pixels);
  grey_.resize(pixels);
  cv::Mat bgr(height, width, CV_8UC3, bgr_.data()), grey(height, width, CV_8UC1, grey_.data());
  picture.convertTo(bgr, CV_8UC3);
  cv::extractChannel(bgr, grey, 1);
  return {frame.number, {bgr_.data(), width, height, std::ptrdiff_t{3} * width}, {grey_.data(), width, height, width}};
}

}  // namespace perimap
