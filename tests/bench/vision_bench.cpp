// Following features from frame to frame: OpenCV's pyramidal Lucas-Kanade and the patch tracker, side by side, in time
// and in pixels from the truth. See run.sh.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/vision/feature_detector.hpp"
#include "core/vision/instrument_mask.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"
#include "footage.hpp"
#include "interleaved_timing.hpp"
#include "machine_text.hpp"

namespace perimap::bench {
namespace {

constexpr int kFrames = 9;
constexpr int kRounds = 14;
constexpr double kPrediction_px = 1.0;  // standard deviation of where a feature is predicted, per axis

// Where each feature was found in one frame; not a number where it was not.
using Places = std::vector<Vector2d>;

const Vector2d kLost = Vector2d::Constant(std::nan(""));

class Method {
 public:
  explicit Method(std::string name_of) : name(std::move(name_of)) {}
  virtual ~Method() = default;
  Method(const Method&) = delete;
  Method& operator=(const Method&) = delete;

  virtual void begin(const Footage& /*footage*/) {}
  // Not timed: what the frame before has left.
  virtual void prepare(const Footage& /*footage*/, std::size_t /*frame*/) {}
  virtual void follow(const Footage& footage, std::size_t frame, const Places& predicted, Places& found) = 0;

  std::string name;
  std::vector<double> ms;
  std::vector<double> errors_px;
  std::vector<double> normalised;  // squared error under the method's own covariance, over 2
  std::vector<double> noise_px;    // the error that the images' noise alone leaves, by the method's own account
  std::vector<bool> near;          // within half a pixel of the truth
  int lost = 0;
};

cv::Mat borrow(const Footage& footage, std::size_t frame) {
  const GreyImage image = footage.image(frame);
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

// From the feature's true place in the frame before.
class LucasKanade final : public Method {
 public:
  LucasKanade(std::string name_of, int levels, bool is_predicted, int threads, bool is_pyramid_ready)
      : Method(std::move(name_of)),
        levels_(levels),
        is_predicted_(is_predicted),
        threads_(threads),
        is_pyramid_ready_(is_pyramid_ready) {}

  void prepare(const Footage& footage, std::size_t frame) override {
    cv::setNumThreads(threads_);
    cv::buildOpticalFlowPyramid(borrow(footage, frame - 1), before_, kWindow, levels_);
    if (is_pyramid_ready_) cv::buildOpticalFlowPyramid(borrow(footage, frame), now_, kWindow, levels_);
    from_.clear();
    for (const Vector2d& px : footage.px[frame - 1]) {
      from_.emplace_back(static_cast<float>(px.x()), static_cast<float>(px.y()));
    }
  }

  void follow(const Footage& footage, std::size_t frame, const Places& predicted, Places& found) override {
    if (!is_pyramid_ready_) cv::buildOpticalFlowPyramid(borrow(footage, frame), now_, kWindow, levels_);
    to_.clear();
    for (const Vector2d& px : predicted) to_.emplace_back(static_cast<float>(px.x()), static_cast<float>(px.y()));
    cv::calcOpticalFlowPyrLK(before_, now_, from_, to_, status_, residual_, kWindow, levels_,
                             {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01},
                             is_predicted_ ? cv::OPTFLOW_USE_INITIAL_FLOW : 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i] = status_[i] != 0 ? Vector2d(to_[i].x, to_[i].y) : kLost;
    }
  }

 private:
  static inline const cv::Size kWindow{21, 21};
  int levels_;
  bool is_predicted_;
  int threads_;
  bool is_pyramid_ready_;
  std::vector<cv::Mat> before_, now_;
  std::vector<cv::Point2f> from_, to_;
  std::vector<std::uint8_t> status_;
  std::vector<float> residual_;
};

// From the template of the first frame.
class Patches final : public Method {
 public:
  explicit Patches(double deviation_px, SimdTarget target = best_simd_target())
      : Patches(std::string("this tracker, ") + simd_target_name(target), deviation_px, target, true) {}
  Patches(std::string name_of, double deviation_px, SimdTarget target, bool affine)
      : Method(std::move(name_of)),
        affine_(affine),
        tracker_(PatchTrackerSettings{}, target),
        covariance_(deviation_px * deviation_px * Matrix2d::Identity()) {}

  void begin(const Footage& footage) override {
    patches_.resize(footage.px[0].size());
    usable_.clear();
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      usable_.push_back(make_patch_template(footage.image(0), footage.px[0][i], TemplateSettings{}, tracker_.kernels(),
                                            patches_[i]) == TemplateVerdict::kGood);
      patches_[i].affine_usable = patches_[i].affine_usable && affine_;
    }
    states_.assign(patches_.size(), PatchState{});
    matches_.resize(patches_.size());
  }

  void follow(const Footage& footage, std::size_t frame, const Places& predicted, Places& found) override {
    const GreyImage image = footage.image(frame);
    for (std::size_t i = 0; i < found.size(); ++i) {
      matches_[i] = tracker_.track(image, patches_[i], states_[i], predicted[i], covariance_);
      found[i] = matches_[i].state == MatchState::kFound ? matches_[i].px : kLost;
    }
  }

  [[nodiscard]] const std::vector<PatchMatch>& matches() const { return matches_; }
  [[nodiscard]] bool is_usable(std::size_t i) const { return usable_[i]; }

 private:
  bool affine_;
  PatchTracker tracker_;
  Matrix2d covariance_;
  std::vector<PatchTemplate> patches_;
  std::vector<PatchState> states_;
  std::vector<PatchMatch> matches_;
  std::vector<bool> usable_;
};

Vector2d as_predicted(std::mt19937& random) {
  std::normal_distribution<double> normal(0, kPrediction_px);
  const double u = normal(random);
  return {u, normal(random)};
}

// Every method follows every frame in turn; the frames between have taken its place in the caches.
template <class StartError>
void run(const Footage& footage, std::vector<Method*> methods, const StartError& start_error, int rounds) {
  std::mt19937 random(5);
  const std::size_t features = footage.px[0].size();
  Places predicted(features), found(features);
  for (int round = 0; round < rounds; ++round) {
    for (Method* method : methods) method->begin(footage);
    for (std::size_t frame = 1; frame < footage.frames.size(); ++frame) {
      for (std::size_t i = 0; i < features; ++i) predicted[i] = footage.px[frame][i] + start_error(random);
      for (Method* method : methods) {
        method->prepare(footage, frame);
        const auto begin = std::chrono::steady_clock::now();
        method->follow(footage, frame, predicted, found);
        const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begin;
        method->ms.push_back(taken.count());
        const auto* patches = dynamic_cast<const Patches*>(method);
        for (std::size_t i = 0; i < features; ++i) {
          if (patches != nullptr && !patches->is_usable(i)) continue;
          constexpr double kNear_px = 0.5;
          method->near.push_back((found[i] - footage.px[frame][i]).norm() < kNear_px);
          if (!found[i].allFinite()) {
            ++method->lost;
            continue;
          }
          const Vector2d e = found[i] - footage.px[frame][i];
          method->errors_px.push_back(e.norm());
          if (patches != nullptr) {
            const Matrix2d& C = patches->matches()[i].covariance_px2;
            method->normalised.push_back(0.5 * e.dot(C.inverse() * e));
            const double floor_px = PatchTrackerSettings{}.sigma_floor_px;
            constexpr double kMedianOfNorm = 1.177;  // of two normal errors of unit variance
            method->noise_px.push_back(kMedianOfNorm * std::sqrt(std::max(0.0, 0.5 * C.trace() - floor_px * floor_px)));
          }
        }
      }
    }
  }
}

void compare(const Footage& footage, const char* light) {
  LucasKanade one_thread("OpenCV LK, 4 levels, one thread", 3, false, 1, false);
  LucasKanade threads("OpenCV LK, 4 levels, default threads", 3, false, -1, false);
  LucasKanade predicted("OpenCV LK, predicted start, 1 level, one thread", 0, true, 1, false);
  LucasKanade bare("  the same, its derivatives made before", 0, true, 1, true);
  Patches patches(kPrediction_px);
  // What LK does: shapes are as they were in the template.
  Patches translation("  the same, translation alone", kPrediction_px, best_simd_target(), false);
  std::vector<Method*> methods = {&one_thread, &threads, &predicted, &bare, &patches, &translation};
  run(footage, methods, as_predicted, kRounds);
  std::printf("\n%s, %dx%d, %zu features, %s light\n", footage.name.c_str(), footage.width, footage.height,
              footage.px[0].size(), light);
  std::printf("  %-48s %8s %8s %8s %9s %9s %7s %9s %8s\n", "", "p50 ms", "p99 ms", "x LK", "median px", "p95 px",
              "lost %", "e2/sigma2", "noise px");
  for (const Method* method : methods) {
    const double share = 100.0 * method->lost / (method->lost + static_cast<double>(method->errors_px.size()));
    double mean = 0;
    for (const double n : method->normalised) mean += n / static_cast<double>(method->normalised.size());
    std::printf("  %-48s %8.3f %8.3f %8.1f %9.3f %9.3f %7.2f", method->name.c_str(), quantile(method->ms, 0.5),
                quantile(method->ms, 0.99), quantile(predicted.ms, 0.5) / quantile(method->ms, 0.5),
                quantile(method->errors_px, 0.5), quantile(method->errors_px, 0.95), share);
    if (method->normalised.empty()) {
      std::printf(" %9s %8s\n", "-", "-");
    } else {
      std::printf(" %9.2f %8.3f\n", mean, quantile(method->noise_px, 0.5));
    }
  }
}

// How many are found within half a pixel of the truth, and of those that are from the true place itself.
void capture(const Footage& footage) {
  LucasKanade predicted("OpenCV LK, predicted start, 1 level", 0, true, 1, false);
  Patches patches(1.5);
  std::vector<Method*> methods = {&predicted, &patches};
  std::vector<std::vector<bool>> at_home(methods.size());
  for (const double distance_px : {0.0, 2.0, 4.0}) {
    for (Method* method : methods) method->near.clear();
    run(
        footage, methods,
        [distance_px](std::mt19937& random) {
          const double angle = std::uniform_real_distribution<double>(0, 2 * M_PI)(random);
          return Vector2d(distance_px * std::cos(angle), distance_px * std::sin(angle));
        },
        3);
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const std::vector<bool>& near = methods[m]->near;
      if (distance_px == 0) at_home[m] = near;
      int all = 0, held = 0, homely = 0;
      for (std::size_t i = 0; i < near.size(); ++i) {
        all += near[i] ? 1 : 0;
        homely += at_home[m][i] ? 1 : 0;
        held += near[i] && at_home[m][i] ? 1 : 0;
      }
      std::printf("  %-10s %dx%d from %.0f px: %-36s %6.2f %% within 0.5 px, %6.2f %% of those that are from 0 px\n",
                  footage.name.c_str(), footage.width, footage.height, distance_px, methods[m]->name.c_str(),
                  100.0 * all / static_cast<double>(near.size()), 100.0 * held / std::max(homely, 1));
    }
  }
}

void compare_targets(const Footage& footage) {
  std::vector<Method*> methods;
  std::vector<std::unique_ptr<Patches>> owned;
  for (const SimdTarget target : simd_targets()) owned.push_back(std::make_unique<Patches>(kPrediction_px, target));
  for (const auto& one : owned) methods.push_back(one.get());
  run(footage, methods, as_predicted, kRounds);
  std::printf("\n%s, %dx%d, %zu features, by instruction set\n", footage.name.c_str(), footage.width, footage.height,
              footage.px[0].size());
  for (const Method* method : methods) {
    std::printf("  %-48s %8.3f %8.3f\n", method->name.c_str(), quantile(method->ms, 0.5), quantile(method->ms, 0.99));
  }
}

// What a round of the finder looks at, beside what the whole picture would cost; all of a red that no instrument has.
void find(const Footage& footage) {
  constexpr int kTimes = 15;
  const int width = reduced_side(footage.width), height = reduced_side(footage.height);
  std::vector<std::uint8_t> bgr;
  for (int i = 0; i < width * height; ++i) bgr.insert(bgr.end(), {70, 80, 180});
  const GreyImage image = footage.image(0);
  const int features = static_cast<int>(footage.px[0].size());
  const int bands = bands_of(footage.width, footage.height);
  const auto look = [&](RowRange rows) {
    const DetectorSettings settings = detector_settings_for(image, features);
    const auto mask = find_instruments({bgr.data(), width, height, 3 * width}, footage.width, footage.height);
    const GreyImage barred{mask.value().data(), footage.width, footage.height, footage.width};
    if (!find_features(image, {}, settings, features, barred, rows)) std::printf("  nothing could be looked for\n");
  };
  std::vector<Candidate> candidates;
  candidates.emplace_back("the whole picture", 1.0, [&] { look({}); });
  candidates.emplace_back("a band of it, one of " + std::to_string(bands), 1.0,
                          [&] { look(rows_of_band(footage.height, bands / 2, bands)); });
  time_interleaved(candidates, kTimes);
  std::printf("\n%s, %dx%d, finding features, ms p50, p99, max\n", footage.name.c_str(), footage.width, footage.height);
  for (const Candidate& candidate : candidates) {
    std::printf("  %-48s %8.2f %8.2f %8.2f\n", candidate.name.c_str(), 1e-6 * candidate.median(),
                1e-6 * candidate.quantile(0.99), 1e-6 * candidate.quantile(1.0));
  }
}

}  // namespace
}  // namespace perimap::bench

int main() {
  using namespace perimap::bench;
  print_machine(PERIMAP_REVISION);
  std::printf(
      "Templates of the first frame, predictions off by %.0f px an axis; LK starts from the true place in the frame\n"
      "before and builds the new frame's pyramid with derivatives, as it must each frame. 'x LK': against LK with\n"
      "predicted start. 'e2/sigma2': mean squared error under the match's own covariance, 1 is calibrated.\n"
      "'noise px': median error that the noise of image and template alone leaves, by residual and Hessian.\n",
      kPrediction_px);
  for (const auto& [width, height] : {std::pair{1280, 720}, std::pair{1920, 1080}}) {
    for (const int features : {50, 200, 500}) {
      for (const Footage& footage :
           {rendered_footage(width, height, kFrames, features), textured_footage(width, height, kFrames, features)}) {
        const Footage lit = under_changing_light(footage);
        compare(footage, "steady");
        compare(lit, "changing");
        if (features == 200) {
          find(footage);
          compare_targets(footage);
          capture(lit);
        }
        std::fflush(stdout);
      }
    }
  }
  return 0;
}
