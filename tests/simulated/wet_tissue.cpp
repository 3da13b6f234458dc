#include "tests/simulated/wet_tissue.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

constexpr int kMargin_px = 48;  // of texture around the picture

// Octaves of noise from `finest` px on, each stronger than the next finer one by `growth`, of this standard deviation.
cv::Mat octaves(cv::Size size, int finest, int count, double growth, double deviation, cv::RNG& random) {
  cv::Mat sum(size, CV_32F, cv::Scalar(0));
  for (int octave = 0; octave < count; ++octave) {
    const int step = finest << octave;
    cv::Mat coarse(size.height / step + 4, size.width / step + 4, CV_32F), fine;
    random.fill(coarse, cv::RNG::NORMAL, 0.0, std::pow(growth, octave));
    cv::resize(coarse, fine, {}, step, step, cv::INTER_CUBIC);
    sum += fine(cv::Rect({step, step}, size));
  }
  cv::Scalar mean, spread;
  cv::meanStdDev(sum, mean, spread);
  return (sum - mean[0]) * (deviation / spread[0]);
}

void add_vessels(cv::Mat& texture, int count, double darkness, cv::RNG& random) {
  for (int vessel = 0; vessel < count; ++vessel) {
    cv::Point2d at(random.uniform(0, texture.cols), random.uniform(0, texture.rows));
    double direction = random.uniform(0.0, kTwoPi);
    cv::Mat drawn(texture.size(), CV_32F, cv::Scalar(0));
    for (int piece = 0; piece < 14; ++piece) {
      direction += random.uniform(-0.5, 0.5);
      const cv::Point2d next = at + 10.0 * cv::Point2d(std::cos(direction), std::sin(direction));
      cv::line(drawn, at, next, cv::Scalar(darkness * random.uniform(0.6, 1.0)), random.uniform(1, 4), cv::LINE_8);
      at = next;
    }
    texture -= drawn;
  }
}

}  // namespace

WetTissue::WetTissue(const WetTissueSettings& settings) : settings_(settings) {
  cv::RNG random(settings.seed);
  const cv::Size size(settings.width + 2 * kMargin_px, settings.height + 2 * kMargin_px);
  texture_ = octaves(size, 3, 5, 1.4, settings.texture_grey, random);
  add_vessels(texture_, settings.width / 10, 2 * settings.texture_grey, random);
  cv::GaussianBlur(texture_, texture_, {}, 1.1);  // the lens
  sheen_ = octaves({settings.width, settings.height}, 8, 3, 1.6, settings.sheen_grey, random);
  for (int i = 0; i < settings.highlights; ++i) {
    highlights_.push_back({{random.uniform(0.0, 1.0) * settings.width, random.uniform(0.0, 1.0) * settings.height},
                           random.uniform(2.0, 6.0),
                           random.uniform(0.0, kTwoPi)});
  }
}

double WetTissue::displaced_by(int number) const {
  const double phase = std::fmod(number / settings_.frames_per_s / settings_.beat_s, 1.0);
  constexpr double kSystole = 0.3, kWidth = 0.12;
  const double off = (phase - kSystole) / kWidth;
  return std::exp(-0.5 * off * off);
}

// Smooth, and different from place to place: the tissue is strained.
Vector2d WetTissue::field(const Vector2d& px) const {
  const double x = px.x() / settings_.width, y = px.y() / settings_.height;
  return settings_.beat_px * Vector2d(0.6 + 0.4 * std::sin(2.1 * y + 0.4), 0.7 * std::cos(1.7 * x + 0.8 * y));
}

Vector2d WetTissue::seen_at(const Vector2d& rest_px, int number) const {
  const double breath = std::sin(kTwoPi * number / settings_.frames_per_s / 4.1);
  return rest_px + displaced_by(number) * field(rest_px) + 2.0 * breath * Vector2d(0.3, 1.0);
}

Vector2d WetTissue::at_rest(const Vector2d& px, int number) const {
  Vector2d rest = px;
  for (int i = 0; i < 8; ++i) rest += px - seen_at(rest, number);  // the motion is near the identity
  return rest;
}

Vector2d WetTissue::moved(const Vector2d& px, int from, int number) const { return seen_at(at_rest(px, from), number); }

// Highlights follow the tissue by a part, and wander.
Vector2d WetTissue::place_of(const Highlight& highlight, int number) const {
  const double t = number / settings_.frames_per_s;
  return highlight.at_px + 0.4 * displaced_by(number) * field(highlight.at_px) +
         7.0 * Vector2d(std::sin(0.9 * t + highlight.phase_rad), std::cos(0.7 * t + 2 * highlight.phase_rad));
}

bool WetTissue::is_highlight(const Vector2d& px, int number, double within_px) const {
  return std::any_of(highlights_.begin(), highlights_.end(), [&](const Highlight& highlight) {
    return (place_of(highlight, number) - px).norm() < within_px + highlight.radius_px;
  });
}

// As JPEG and its like do to each block.
void WetTissue::compress(cv::Mat& channel) const {
  constexpr int kBlock = 8;
  for (int y = 0; y + kBlock <= channel.rows; y += kBlock) {
    for (int x = 0; x + kBlock <= channel.cols; x += kBlock) {
      cv::Mat block = channel(cv::Rect(x, y, kBlock, kBlock)), cosines;
      cv::dct(block, cosines);
      for (int v = 0; v < kBlock; ++v) {
        for (int u = 0; u < kBlock; ++u) {
          const double step = settings_.compression * (1 + 0.25 * (u + v));
          float& value = cosines.at<float>(v, u);
          value = static_cast<float>(step * std::round(value / step));
        }
      }
      cv::idct(cosines, block);
    }
  }
}

// Where each pixel's tissue lies in the texture; the motion is smooth, so that a coarse grid tells it.
std::pair<cv::Mat, cv::Mat> WetTissue::texture_places(int number) const {
  constexpr int kStep = 6;
  const int columns = settings_.width / kStep + 2, rows = settings_.height / kStep + 2;
  cv::Mat grid_x(rows, columns, CV_32F), grid_y(rows, columns, CV_32F);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) {
      const Vector2d rest = at_rest(Vector2d(kStep * u, kStep * v), number);
      grid_x.at<float>(v, u) = static_cast<float>(rest.x() + kMargin_px);
      grid_y.at<float>(v, u) = static_cast<float>(rest.y() + kMargin_px);
    }
  }
  const cv::Size size(settings_.width, settings_.height);
  const cv::Matx23d to_grid(1.0 / kStep, 0, 0, 0, 1.0 / kStep, 0);
  cv::Mat map_x, map_y;
  constexpr int kInverse = cv::INTER_LINEAR | cv::WARP_INVERSE_MAP;
  cv::warpAffine(grid_x, map_x, to_grid, size, kInverse);
  cv::warpAffine(grid_y, map_y, to_grid, size, kInverse);
  return {map_x, map_y};
}

WetTissue::Frame WetTissue::frame(int number) {
  const cv::Size size(settings_.width, settings_.height);
  const auto [map_x, map_y] = texture_places(number);
  cv::Mat green;
  cv::remap(texture_, green, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REFLECT);
  // What is wet shines differently as it moves.
  green += (0.4 + displaced_by(number)) * sheen_;
  cv::RNG random(settings_.seed * 7919 + static_cast<std::uint64_t>(number) + 1);
  cv::Mat noise(size, CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0.0, settings_.noise_grey);
  const double gain = 1 + 0.04 * std::sin(0.11 * number);
  const std::array<double, 3> base{70, 85, 175}, of_texture{0.6, 1.0, 0.4};
  std::vector<cv::Mat> channels;
  for (std::size_t c = 0; c < base.size(); ++c) {
    cv::Mat channel = gain * (base[c] + of_texture[c] * green);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double r = std::hypot(x - 0.5 * size.width, y - 0.5 * size.height) / (0.7 * size.width);
        channel.at<float>(y, x) *= static_cast<float>(1 - 0.4 * r * r);
      }
    }
    channel += noise;
    channels.push_back(channel);
  }
  for (const Highlight& highlight : highlights_) {
    const Vector2d at = place_of(highlight, number);
    for (cv::Mat& channel : channels) {
      const cv::RotatedRect box(
          cv::Point2f(static_cast<float>(at.x()), static_cast<float>(at.y())),
          cv::Size2f(static_cast<float>(2 * highlight.radius_px), static_cast<float>(1.2 * highlight.radius_px)),
          static_cast<float>(40 * highlight.phase_rad));
      cv::ellipse(channel, box, cv::Scalar(270), cv::FILLED, cv::LINE_8);
    }
  }
  for (cv::Mat& channel : channels) {
    cv::GaussianBlur(channel, channel, {}, 0.6);
    compress(channel);
    channel.convertTo(channel, CV_8U);
  }
  cv::merge(channels, bgr_);
  green_ = channels[1];
  return {{green_.data, green_.cols, green_.rows, static_cast<std::ptrdiff_t>(green_.step)},
          {bgr_.data, bgr_.cols, bgr_.rows, static_cast<std::ptrdiff_t>(bgr_.step)}};
}

}  // namespace perimap
