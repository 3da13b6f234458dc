// Housekeeping: finds new features in a part of a frame and follows them through the next few, on a thread of its own,
// so that they can be adopted at a stated frame.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/error/expected.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"
#include "core/vision/feature_detector.hpp"
#include "core/vision/last_view.hpp"
#include "core/vision/patch_continuity.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// A feature found in the round's first frame and still followed in its last.
struct FoundFeature {
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();
  PatchTemplate patch;
  PatchState patch_state;  // in the round's last frame
  PatchContinuity looks;
  Vector2d velocity_px = Vector2d::Zero();  // per frame; while the round lasts, from one that is taken to the next
  double place_px2 = 0;                     // variance of patch_state.px per axis, with what it has drifted by
  double doubt_px = 0;                      // deviations of its matches, summed over the round
};

// A round: the frame begun at, and kFinderFrames - 1 after it, are copied here by the mapper as they come; the result
// is due at the frame after them. A fast camera's are not all taken: the search needs its time. One round at a time, in
// one band of the picture, so that a large picture's search takes not much longer than a small one's; the next round
// takes the next band, and no band gives more than its share of a full map at a time. A band that holds its share
// already is passed over while another one, which holds less, still gives something: else the features would gather
// where they live longest. What is a corner goes by the picture's own light and noise; where there are too few, what
// stands out of the noise at all is tried too. More are followed than there is room for; the surest come first.
// Where frames have come with colour lately, a round begins at one that has it, and finds nothing on what is grey like
// instruments. offer() and adopt() belong to the mapper, serve() to the housekeeping thread.
class FeatureFinder {
 public:
  static constexpr std::size_t kMaximumPerRound = 48;

  FeatureFinder(const PipelineSettings& settings, PipelineCounters& counters);

  // Mapper, once a frame after its features are known: takes what the round needs of it. `colour` is reduced as
  // colour_image.hpp says, or without pixels. `occupied` are the pixels of the features that are followed now; a round
  // begins only when `wanted` > 0.
  void offer(std::uint64_t frame_index, const FrameStamp& stamp, const FrameRate& rate, const GreyImage& image,
             const ColourImage& colour, std::span<const Vector2d> occupied, int wanted) noexcept;

  // Mapper, once a frame before its features are followed: the result that is due at this frame; empty when none is.
  // A result that is not there in time is lost and counted; in lockstep it is waited for.
  [[nodiscard]] std::span<const FoundFeature> adopt(std::uint64_t frame_index) noexcept;

  // Mapper: what a template needed in the last round that was adopted from, or could have been; as it stands before.
  [[nodiscard]] const TemplateSettings& templates() const noexcept { return adopted_templates_; }

  // Mapper: what the running round finds is not to be adopted. The next one is as ever.
  void discard_round() noexcept { discarded_ = active_; }

  // Until dismiss().
  void serve() noexcept;
  void dismiss() noexcept;

 private:
  struct Frame {
    FrameStamp stamp;
    std::vector<std::uint8_t> pixels;
  };

  [[nodiscard]] int next_band() noexcept;
  [[nodiscard]] std::uint64_t adopted_at() const noexcept { return begun_at_ + (kFinderFrames - 1) * stride_ + 1; }
  [[nodiscard]] bool may_begin(std::uint64_t frame_index, const FrameRate& rate, const ColourImage& colour) noexcept;
  void work(int step) noexcept;
  void find(const Frame& frame) noexcept;
  [[nodiscard]] Expected<std::vector<std::uint8_t>> instruments() const;
  [[nodiscard]] bool add_corners(const Frame& frame, const DetectorSettings& detector, const GreyImage& barred);
  [[nodiscard]] GreyImage image_of(const Frame& frame) const noexcept {
    return {frame.pixels.data(), width_, height_, width_};
  }
  void track_candidates(const Frame& frame, const Frame& before) noexcept;
  [[nodiscard]] PatchMatch find_candidate(FoundFeature& feature, const Frame& frame, const Frame& before) noexcept;
  void put_the_surest_first() noexcept;

  int width_;
  int height_;
  int bands_;
  Duration interval_;
  bool lockstep_;
  double min_distance_px_;
  int maximum_;
  std::size_t share_;  // of a full map, a band's
  PatchTracker tracker_;
  PatchTracker view_tracker_ = LastView::tracker();
  PipelineCounters& counters_;

  // The mapper's own.
  bool active_ = false;
  bool discarded_ = false;  // the round that is active
  std::uint64_t begun_at_ = 0;
  std::uint64_t next_round_at_ = 0;
  std::uint64_t colour_until_ = 0;     // up to this frame one with colour is waited for
  std::vector<std::size_t> in_bands_;  // features followed, by band
  std::vector<bool> gave_;             // by band: whether its last round found anything
  TemplateSettings adopted_templates_;

  // Filled by the mapper before the step's number goes into the ring, read by housekeeping after it comes out.
  std::array<Frame, kFinderFrames> frames_;
  std::vector<std::uint8_t> bgr_;  // of the first one, reduced, without gaps between rows
  bool coloured_ = false;
  std::uint64_t stride_ = 1;  // frames from one that is taken to the next
  double stride_s_ = 0.0;
  int band_ = 0;
  std::vector<Vector2d> occupied_;
  std::size_t tried_ = 0;  // at most
  std::size_t wanted_ = 0;
  SpscRing<int> steps_;
  Wakeup go_;

  // Housekeeping's own until done_ is set; the mapper's until the next round begins.
  std::vector<FoundFeature> found_;
  TemplateSettings templates_;
  std::atomic<bool> done_{false};
  Wakeup finished_;

  // Relaxed throughout: the flag alone is the message, and the post of go_ that follows orders it.
  std::atomic<bool> dismissed_{false};
};

}  // namespace perimap
