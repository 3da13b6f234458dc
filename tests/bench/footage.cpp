#include "footage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/vision/feature_detector.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap::bench {
namespace {

constexpr double kSensorNoise = 1.2;  // grey levels, as the simulator's sensor has at a middling grey

std::vector<Vector2d> corners(const Footage& footage, int features) {
  DetectorSettings settings;
  settings.tile_px = 32;
  settings.border_px = 40;
  const auto found = find_features(footage.image(0), {}, settings, features);
  if (!found) {
    std::fprintf(stderr, "%s\n", found.error().message.c_str());
    std::exit(1);
  }
  return *found;
}

bool is_inside(const Footage& footage, const Vector2d& px) {
  constexpr double kBorder_px = 24;
  return px.x() > kBorder_px && px.y() > kBorder_px && px.x() < footage.width - kBorder_px &&
         px.y() < footage.height - kBorder_px;
}

// Leaves out what is not in view in every frame.
void keep_visible(Footage& footage, const std::vector<bool>& visible) {
  for (std::vector<Vector2d>& places : footage.px) {
    std::vector<Vector2d> kept;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (visible[i]) kept.push_back(places[i]);
    }
    places = kept;
  }
}

}  // namespace

Footage rendered_footage(int width, int height, int frames, int features) {
  SimulationSettings settings;
  settings.width = width;
  settings.height = height;
  settings.duration = std::chrono::seconds(2);
  const auto simulation = Simulation::create(settings);
  if (!simulation) {
    std::fprintf(stderr, "%s\n", simulation.error().message.c_str());
    std::exit(1);
  }
  Footage footage{"rendered", width, height, {}, {}};
  RenderWorkspace workspace;
  for (int k = 0; k < frames; ++k) {
    footage.frames.emplace_back(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    simulation->render(static_cast<std::size_t>(k), workspace, footage.frames.back());
  }
  const auto first = simulation->frames().front();
  std::vector<SurfacePoint> points;
  std::vector<Vector2d> starts;
  for (const Vector2d& px : corners(footage, features)) {
    const auto point = simulation->truth().first_hit(first.X_WC, simulation->lens().ray(px), first.stamp.capture);
    if (point) points.push_back(*point);
  }
  std::vector<bool> visible(points.size(), true);
  for (int k = 0; k < frames; ++k) {
    const auto& frame = simulation->frames()[static_cast<std::size_t>(k)];
    footage.px.emplace_back();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3d p_W = simulation->truth().position(points[i], frame.stamp.capture);
      const Vector2d px = simulation->lens().project(frame.X_WC.inverse() * p_W);
      const auto seen = simulation->truth().first_hit(frame.X_WC, simulation->lens().ray(px), frame.stamp.capture);
      constexpr double kSamePlace_mm = 0.5;
      const bool is_hidden =
          !seen || (simulation->truth().position(*seen, frame.stamp.capture) - p_W).norm() > kSamePlace_mm;
      if (is_hidden || !is_inside(footage, px)) visible[i] = false;
      footage.px.back().push_back(px);
    }
  }
  keep_visible(footage, visible);
  return footage;
}

Footage textured_footage(int width, int height, int frames, int features) {
  constexpr int kMargin = 64;
  // Texels a pixel: on the pixels' own grid cubic interpolation moves what it draws, OpenCV's by up to 0.05 px.
  constexpr int kFine = 3;
  cv::RNG random(7);
  // Octaves of noise, each half as strong as the next coarser one.
  cv::Mat tissue(kFine * (height + 2 * kMargin), kFine * (width + 2 * kMargin), CV_32F, cv::Scalar(0));
  for (int octave = 0; octave < 6; ++octave) {
    const int step = kFine * (4 << octave);
    cv::Mat coarse((tissue.rows + step - 1) / step + 4, (tissue.cols + step - 1) / step + 4, CV_32F);
    random.fill(coarse, cv::RNG::NORMAL, 0.0, 3.0 * std::pow(1.5, octave));
    cv::Mat fine;
    cv::resize(coarse, fine, {}, step, step, cv::INTER_CUBIC);
    tissue += fine(cv::Rect(step, step, tissue.cols, tissue.rows));
  }
  for (int vessel = 0; vessel < width / 10; ++vessel) {
    cv::Point2d at(random.uniform(0, tissue.cols), random.uniform(0, tissue.rows));
    double direction = random.uniform(0.0, 6.28);
    const double darkness = random.uniform(8.0, 25.0);
    const int thickness = kFine * random.uniform(1, 4);
    for (int piece = 0; piece < 12; ++piece) {
      direction += random.uniform(-0.5, 0.5);
      const cv::Point2d next = at + 12.0 * kFine * cv::Point2d(std::cos(direction), std::sin(direction));
      cv::line(tissue, at, next,
               cv::Scalar(tissue.at<float>(std::clamp(static_cast<int>(at.y), 0, tissue.rows - 1),
                                           std::clamp(static_cast<int>(at.x), 0, tissue.cols - 1)) -
                          darkness),
               thickness, cv::LINE_8);
      at = next;
    }
  }
  cv::GaussianBlur(tissue, tissue, {}, 0.9 * kFine);  // the lens

  // Where the texture's point p (from the image's corner) is seen in frame k.
  const auto seen_at = [&](const Vector2d& p, int k) {
    const double angle = 0.002 * k, scale = 1 + 0.002 * k;
    const Vector2d centre(0.5 * width, 0.5 * height), d = p - centre;
    const Vector2d turned(std::cos(angle) * d.x() - std::sin(angle) * d.y(),
                          std::sin(angle) * d.x() + std::cos(angle) * d.y());
    const Vector2d bent(1.2 * std::sin(0.9 * k) * std::sin(p.y() / 90),
                        1.2 * std::sin(0.7 * k) * std::cos(p.x() / 110));
    return Vector2d(centre + scale * turned + Vector2d(1.7 * k, -1.1 * k) + bent);
  };
  Footage footage{"textured", width, height, {}, {}};
  for (int k = 0; k < frames; ++k) {
    cv::Mat map_x(height, width, CV_32F), map_y(height, width, CV_32F);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Vector2d px(x, y);
        Vector2d p = px;
        for (int i = 0; i < 6; ++i) p += px - seen_at(p, k);  // the motion is near the identity
        map_x.at<float>(y, x) = static_cast<float>(kFine * (p.x() + kMargin));
        map_y.at<float>(y, x) = static_cast<float>(kFine * (p.y() + kMargin));
      }
    }
    cv::Mat seen;
    cv::remap(tissue, seen, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REFLECT);
    cv::Mat noise(height, width, CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0.0, kSensorNoise);
    std::vector<std::uint8_t> frame(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double r = std::hypot(x - 0.5 * width, y - 0.5 * height) / (0.6 * width);
        const double grey = (125 + seen.at<float>(y, x)) * (1 - 0.5 * r * r) + noise.at<float>(y, x);
        frame[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
      }
    }
    footage.frames.push_back(frame);
  }
  const std::vector<Vector2d> starts = corners(footage, features);
  std::vector<bool> visible(starts.size(), true);
  for (int k = 0; k < frames; ++k) {
    footage.px.emplace_back();
    for (std::size_t i = 0; i < starts.size(); ++i) {
      footage.px.back().push_back(seen_at(starts[i], k) - seen_at(starts[i], 0) + starts[i]);
      if (!is_inside(footage, footage.px.back().back())) visible[i] = false;
    }
  }
  keep_visible(footage, visible);
  return footage;
}

Footage under_changing_light(const Footage& footage) {
  Footage lit = footage;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (std::vector<std::uint8_t>& frame : lit.frames) {
    const double gain = 1 + std::copysign(0.06, unit(random)), bias = std::copysign(4.0, unit(random));
    for (std::uint8_t& pixel : frame) {
      pixel = static_cast<std::uint8_t>(std::clamp(std::lround(gain * pixel + bias), 0L, 255L));
    }
  }
  return lit;
}

}  // namespace perimap::bench
