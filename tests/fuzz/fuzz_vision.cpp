// Any bytes as an image of odd size and stride, with features sought anywhere in any shape: nothing outside the image
// is read (the buffer ends with the last pixel), and what is said to be found is a place in it. What a match is judged
// by beyond that (its looks, the motion around it) takes any numbers.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/following/feature_follower.hpp"
#include "core/following/picture_validity.hpp"
#include "core/following/seen_places.hpp"
#include "core/vision/feature_detector.hpp"
#include "core/vision/image_noise.hpp"
#include "core/vision/instrument_mask.hpp"
#include "core/vision/last_view.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_continuity.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace {

// Takes the input from its front; zeros when it is used up.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  template <class T>
  T take() {
    T value{};
    const std::size_t n = std::min(sizeof value, size_);
    std::memcpy(&value, data_, n);
    data_ += n;
    size_ -= n;
    return value;
  }
  int below(int limit) { return take<std::uint16_t>() % limit; }
  // The rest over and over, so that a short input too makes texture.
  std::vector<std::uint8_t> pixels(std::size_t count) const {
    std::vector<std::uint8_t> filled(count);
    for (std::size_t i = 0; i < count; ++i) filled[i] = size_ == 0 ? 0 : data_[(i * 7 + i / 31) % size_];
    return filled;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  Input input(data, size);
  const int width = 1 + input.below(130), height = 1 + input.below(130), padding = input.below(9);
  const std::ptrdiff_t stride = width + padding;
  const Vector2d at(input.take<float>(), input.take<float>());
  const Vector2d predicted(input.take<float>(), input.take<float>());
  const Vector2d inside(input.below(4 * width) / 4.0, input.below(4 * height) / 4.0);
  const double deviation = std::abs(static_cast<double>(input.take<float>()));
  PatchState state;
  for (int i = 0; i < 4; ++i) state.A(i / 2, i % 2) += input.take<std::int8_t>() / 40.0;
  PatchContinuity looks;
  const int believed = input.below(8);
  for (int i = 0; i < believed; ++i) looks.add(input.take<float>());
  const auto usual_frames = static_cast<double>(input.take<std::uint64_t>());
  const std::vector<std::uint8_t> pixels = input.pixels(static_cast<std::size_t>((height - 1) * stride + width));
  const GreyImage image{pixels.data(), width, height, stride};

  const std::vector<SimdTarget> targets = simd_targets();
  const PatchTracker tracker(PatchTrackerSettings{}, targets[static_cast<std::size_t>(width) % targets.size()]);
  TemplateSettings easy;
  easy.min_texture = easy.min_texture_coarse = 1e-3;
  easy.max_saturated_share = 1;
  PatchTemplate patch;
  for (const Vector2d& px : {at, inside}) {
    if (make_patch_template(image, px, easy, tracker.kernels(), patch) != TemplateVerdict::kGood) continue;
    for (const Vector2d& sought : {predicted, inside, px}) {
      PatchState now = state;
      const PatchMatch match = tracker.track(image, patch, now, sought, deviation * deviation * Matrix2d::Identity());
      if (match.state != MatchState::kFound) continue;
      const bool is_inside =
          match.px.x() >= 0 && match.px.y() >= 0 && match.px.x() <= width - 1 && match.px.y() <= height - 1;
      if (!is_inside || !match.covariance_px2.allFinite() || !(match.covariance_px2.determinant() > 0)) std::abort();
      // Whatever it has been taken for before: what looks the same and fits perfectly is never something else.
      (void)looks.is_plausible(state, now, match.correlation, usual_frames);
      PatchContinuity usual;
      usual.add(match.correlation);
      if (!usual.is_plausible(now, now, 1, 1)) std::abort();
    }
  }

  NeighbourMotion motion(10);
  for (int i = 0; i < 12; ++i) motion.add(inside + i * predicted, at - i * inside);
  const NeighbourMotion::Around around = motion.around(at, &inside);
  if (around.known && at.allFinite() && predicted.allFinite() && !(around.disagreement_px >= 0)) std::abort();

  const DetectorSettings detector = detector_settings_for(image, 20);
  const auto corners = find_features(image, {}, detector, 20);
  if (!corners) std::abort();
  const RowRange rows{input.take<std::int16_t>(), input.take<std::int16_t>()};
  const auto in_rows = find_features(image, *corners, detector, 20, image, rows);
  if (!in_rows) std::abort();
  for (const Vector2d& px : *in_rows) {
    if (px.y() < rows.begin || px.y() >= rows.end) std::abort();
  }
  FollowerSettings settings;
  settings.maximum = 20;
  FeatureFollower follower(settings);
  follower.add(image, *corners, easy);
  for (int i = 0; i < 3; ++i) follower.track_into(image);
  const PatchTracker view_tracker = LastView::tracker();
  LastView view;
  view.make(image, 0, inside, view_tracker.kernels());
  if (view.is_of(0)) {
    const Matrix2d covariance = deviation * deviation * Matrix2d::Identity();
    for (const Vector2d& sought : {predicted, inside}) {
      for (const PatchMatch& match : {view.follow(view_tracker, image, image, inside, sought, covariance),
                                      view.find_again(view_tracker, image, sought, covariance)}) {
        if (match.state != MatchState::kFound) continue;
        if (!match.px.allFinite() || !match.covariance_px2.allFinite()) std::abort();
        view.drift_to(match);
      }
    }
    if (!(view.drift_px2() >= 0)) std::abort();
  }
  PictureValidity validity{FrameRate()};
  for (int i = 0; i < 2; ++i) validity.look_at(image);
  for (const Vector2d& px : {at, inside}) (void)validity.at(px);
  const Thumbnail small = thumbnail_of(image);
  const auto displacement = displacement_between(small, small);
  if (displacement && !(displacement->norm() < 1e-9)) std::abort();
  for (const int reduction : {1, 4}) {
    if (width >= 3 && !find_instruments({pixels.data(), width / 3, height, stride}, reduction * width, height)) {
      std::abort();
    }
  }
  return 0;
}
