// What pictures look like, by what matters to a tracker: a line for each video or recording given. So footage and
// simulated looks can be held side by side. Arguments: FILE[:FRAMES]...
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/vision/image_noise.hpp"
#include "core/vision/picture_light.hpp"
#include "daemon/evaluation/tracking/frame_source.hpp"

namespace perimap::bench {
namespace {

double quantile(std::vector<double>& values, double share) {
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

struct Look {
  std::vector<double> noise, lit, gradient, blur, blocks, weak_corner, strong_corner, highlights, light_steps, wander;
};

// The smaller eigenvalue of the mean gradient product in tiles of a 16th of the width: what the detector goes by.
void add_corners(const cv::Mat& gx, const cv::Mat& gy, const cv::Mat& usable, Look& look) {
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
  look.weak_corner.push_back(quantile(best, 0.25));
  look.strong_corner.push_back(quantile(best, 0.75));
}

// Steps across the borders of 8 x 8 blocks over those within them: 1 without compression.
double blockiness(const cv::Mat& image, const cv::Mat& usable) {
  constexpr int kBlock = 8;
  double across = 0, within = 0, n_across = 0, n_within = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 1; x < image.cols; ++x) {
      if (usable.at<std::uint8_t>(y, x) == 0) continue;
      const double step = std::abs(image.at<std::uint8_t>(y, x) - image.at<std::uint8_t>(y, x - 1));
      (x % kBlock == 0 ? across : within) += step;
      (x % kBlock == 0 ? n_across : n_within) += 1;
    }
  }
  return within > 0 && n_across > 0 ? across / n_across / (within / n_within) : 1;
}

class Watch {
 public:
  void look_at(const GreyImage& given, Look& look) {
    const cv::Mat image(given.height, given.width, CV_8UC1, const_cast<std::uint8_t*>(given.data),
                        static_cast<std::size_t>(given.stride));
    const PictureLight light = estimate_light(given);
    constexpr int kBelowWhite = 10;
    const cv::Mat bright = image >= light.white_grey - kBelowWhite;
    cv::Mat usable;
    cv::dilate(bright, usable, cv::getStructuringElement(cv::MORPH_RECT, {15, 15}));
    usable = ~usable & (image > 0.3 * light.lit_grey);
    cv::Mat smooth, smoother, gx, gy, wide_x, wide_y;
    constexpr double kSobel = 1.0 / 8;
    cv::GaussianBlur(image, smooth, {5, 5}, 1.0);
    cv::GaussianBlur(image, smoother, {}, 3.0);
    cv::Sobel(smooth, gx, CV_32F, 1, 0, 3, kSobel);
    cv::Sobel(smooth, gy, CV_32F, 0, 1, 3, kSobel);
    cv::Sobel(smoother, wide_x, CV_32F, 1, 0, 3, kSobel);
    cv::Sobel(smoother, wide_y, CV_32F, 0, 1, 3, kSobel);
    const double energy = cv::mean(gx.mul(gx) + gy.mul(gy), usable)[0];
    const double wide = cv::mean(wide_x.mul(wide_x) + wide_y.mul(wide_y), usable)[0];
    look.noise.push_back(estimate_noise(given));
    look.lit.push_back(light.lit_grey);
    look.gradient.push_back(std::sqrt(energy));
    look.blur.push_back(wide > 0 ? std::sqrt(energy / wide) : 0);
    look.blocks.push_back(blockiness(image, usable));
    add_corners(gx, gy, usable, look);
    look.highlights.push_back(100.0 * cv::countNonZero(bright) / (image.rows * image.cols));
    if (!bright_before_.empty()) {
      look.light_steps.push_back(std::abs(light.lit_grey - lit_before_) / std::max(lit_before_, 1.0));
      cv::Mat changed = bright ^ bright_before_;
      const double both = cv::countNonZero(bright | bright_before_);
      if (both > 0) look.wander.push_back(cv::countNonZero(changed) / both);
    }
    bright_before_ = bright.clone();
    lit_before_ = light.lit_grey;
  }

 private:
  cv::Mat bright_before_;
  double lit_before_ = 0;
};

bool run(const std::string& argument) {
  std::string path = argument;
  std::size_t frames = 60;
  if (const auto colon = argument.rfind(':'); colon != std::string::npos) {
    path = argument.substr(0, colon);
    frames = std::strtoul(argument.c_str() + colon + 1, nullptr, 10);
  }
  auto source = FrameSource::open(path);
  if (!source) {
    std::fprintf(stderr, "%s\n", source.error().message.c_str());
    return false;
  }
  Look look;
  Watch watch;
  int width = 0, height = 0;
  for (std::size_t k = 0; k < frames; ++k) {
    const auto frame = (*source)->next();
    if (!frame || *frame == nullptr) break;
    width = (*frame)->grey.width;
    height = (*frame)->grey.height;
    watch.look_at((*frame)->grey, look);
  }
  const auto slash = path.rfind('/');
  std::printf("%-26.26s %4dx%-4d | %5.1f %5.2f | %6.2f %5.2f %5.2f | %6.2f %6.2f | %6.2f %5.2f | %5.2f\n",
              path.substr(slash == std::string::npos ? 0 : slash + 1).c_str(), width, height, mean(look.lit),
              mean(look.noise), mean(look.gradient), mean(look.blur), mean(look.blocks), mean(look.weak_corner),
              mean(look.strong_corner), mean(look.highlights), mean(look.wander), 100 * mean(look.light_steps));
  return true;
}

}  // namespace
}  // namespace perimap::bench

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "look_bench FILE[:FRAMES]...\n");
    return 2;
  }
  std::printf(
      "%36s | lit, noise | gradient, fine over coarse, blocks | corners' weaker, stronger quarter | highlights %%,\n"
      "%36s | share of them that changes in a frame | light's change in a frame %%\n",
      "", "");
  bool all = true;
  for (int i = 1; i < argc; ++i) all = perimap::bench::run(argv[i]) && all;
  return all ? 0 : 1;
}
