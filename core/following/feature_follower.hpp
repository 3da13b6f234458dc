// Follows features through video of which nothing else is known: no map, no camera pose, no phase. For a recording with
// those, the pipeline predicts each feature from its map instead.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/following/common_motion.hpp"
#include "core/following/feature_trails.hpp"
#include "core/following/followed_feature.hpp"
#include "core/following/overlay_watch.hpp"
#include "core/following/past_layouts.hpp"
#include "core/following/picture_validity.hpp"
#include "core/following/seen_places.hpp"
#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

struct FollowerSettings {
  int maximum = 200;
  FrameRate rate;  // of the pictures
  // Found so long and so often, and moving as its neighbours do, a candidate is tracked.
  Duration candidate = std::chrono::milliseconds(267);
  int candidate_frames = 8;
  // Unseen so long, and in so many frames of those that show anything, a feature is lost.
  Duration occluded = std::chrono::seconds(2);
  int occluded_frames = 15;
  // Likewise where others tell where it ought to be.
  Duration remembered = std::chrono::seconds(10);
  // Where the picture shows no tissue, and where nearly all features were lost together, so long.
  Duration hidden = std::chrono::seconds(120);
  double least_deviation_px = 1.0;    // of a prediction, per axis
  double widest_deviation_px = 11.0;  // the search reaches +-40 px
  // So little that only what has nothing in common is left out: weak texture correlates badly with itself from one
  // frame to the next, by its noise. The way back judges (followed_patch.hpp).
  double min_correlation = 0.5;
  double recovered_correlation = 0.97;  // asked of a feature that comes back, for which there is no way back
  // Of one that comes back where others have it that come back with it, or that were never away.
  double vouched_correlation = 0.9;
  double recalled_correlation = 0.85;  // where nearly all come back, moved alike
  // A place that shows what was laid over the picture takes no feature so long.
  Duration overlay = std::chrono::seconds(30);
  // Candidates that may be on trial beside as many features as are wanted, of the maximum; the best become features.
  double candidates_per_place = 1.0;
};

// How a feature is predicted: by its own last displacement (constant velocity); where that fails, by the displacement
// of the features around it in this very frame; where most fail at once, the camera has jerked, and all are sought
// widely. The deviation of a prediction is what predictions have lately been off by.
//
// Where nearly all fail even so, the picture is another one: a cut, smoke, a leap. The few that something was found for
// are not believed. All are kept where they were, and taken back only together, when a good share of them is found
// moved alike (common_motion.hpp); where to is told beforehand by a coarse picture of where they vanished
// (seen_places.hpp). What does not go with what comes back around it is not taken back. What is missed in a region that
// shows no tissue (picture_validity.hpp) counts as hidden. A frame without contrast (black, faded) is no look at
// anything: nothing is sought and nothing is missed. What comes back alone is held against those that began with it
// (birth_layout.hpp).
//
// What is laid over the picture is let go (overlay_watch.hpp). How a feature's looks are kept is in followed_patch.hpp.
// More candidates are tried than there are places; those whose matches were surest become features. A match's deviation
// refuses nothing.
class FeatureFollower {
 public:
  explicit FeatureFollower(const FollowerSettings& settings);

  // Finds every feature in the next frame, or notes that it is not there. Takes nothing from the heap.
  void track_into(const GreyImage& image) noexcept;

  // New candidates at these pixels of the image followed last. Those that make no good template are left out. The first
  // call takes memory for a copy of the image, and one with an image of another size.
  void add(const GreyImage& image, std::span<const Vector2d> corners, const TemplateSettings& settings) noexcept;

  [[nodiscard]] std::span<const FollowedFeature> features() const noexcept { return features_; }
  // Of the last frame.
  [[nodiscard]] const PictureValidity& validity() const noexcept { return validity_; }
  // False when the last frame had no contrast.
  [[nodiscard]] bool saw_anything() const noexcept { return blind_frames_ == 0; }
  // Candidates that it would take.
  [[nodiscard]] int free() const noexcept;
  // As many as can be on trial where no place is filled.
  [[nodiscard]] int most_candidates() const noexcept {
    return static_cast<int>((1 + settings_.candidates_per_place) * settings_.maximum);
  }
  // Where no new feature is wanted: at those that fill a place, and at what is laid over the picture.
  [[nodiscard]] std::vector<Vector2d> occupied() const;
  // So many frames later it is known whether a feature is one, or laid over the picture.
  [[nodiscard]] std::size_t frames_to_judge() const noexcept;

 private:
  [[nodiscard]] bool seek(const GreyImage& image, FollowedFeature& feature, const Vector2d& predicted,
                          double deviation_px, double min_correlation, bool is_vouched_for = false,
                          const Matrix2d& reshaped_by = Matrix2d::Identity()) const noexcept;
  [[nodiscard]] bool seek_vouched_for(const GreyImage& image, FollowedFeature& feature, const Vector2d& expected,
                                      double deviation_px,
                                      const Matrix2d& reshaped_by = Matrix2d::Identity()) const noexcept;
  // Of the features around `px`, without `but`; its own velocity where there are too few.
  [[nodiscard]] NeighbourMotion::Around around(const Vector2d& px, const FollowedFeature* but) const noexcept;
  [[nodiscard]] Vector2d displacement_around(const Vector2d& px, const FollowedFeature* but) const noexcept {
    return around(px, but).by;
  }
  void note_displacements() noexcept;
  void follow_jerk(const GreyImage& image) noexcept;
  void find_again(const GreyImage& image) noexcept;
  void find_by_layouts(const GreyImage& image) noexcept;
  void seek_by_layout(const GreyImage& image, std::uint32_t layout) noexcept;
  void believe_by_layout(const GreyImage& image, std::uint32_t layout) noexcept;
  [[nodiscard]] bool learn_motion_since(std::uint32_t layout, int width) noexcept;
  [[nodiscard]] std::uint32_t layout_before(const FollowedFeature& feature, int frames_ago) const noexcept;
  [[nodiscard]] bool take_back_stray(FollowedFeature& feature, int missed_frames) noexcept;
  // From one settled view of a feature, and one layout, to the next.
  [[nodiscard]] std::uint64_t settling_frames() const noexcept;
  // As many as take so long, but not fewer than there must be to tell anything.
  [[nodiscard]] int frames(Duration time, int least) const noexcept;
  [[nodiscard]] bool has_vanished() const noexcept;
  void disbelieve(FollowedFeature& feature) const noexcept;
  [[nodiscard]] bool has_lately_been_lost(const FollowedFeature& feature) const noexcept;
  void note_picture(const GreyImage& image) noexcept;
  void sweep() noexcept;
  void recall_swept(const GreyImage& image) noexcept;
  [[nodiscard]] bool recall_place(const GreyImage& image, int place, const Thumbnail& now) noexcept;
  std::size_t probe(const GreyImage& image, int place) noexcept;
  [[nodiscard]] std::size_t agree_on_return(const GreyImage& image, int place) noexcept;
  [[nodiscard]] std::size_t take_back(const GreyImage& image, int place) noexcept;
  void hold_against_others(const GreyImage& image) noexcept;
  void judge(const GreyImage& image) noexcept;
  // `astray`: by how much it moved otherwise than its neighbours.
  [[nodiscard]] bool is_strange(const Vector2d& astray, const NeighbourMotion::Around& neighbours) const noexcept;
  [[nodiscard]] bool moves_with_neighbours(FollowedFeature& feature, bool is_back) noexcept;
  void remember(const GreyImage& image) noexcept;

  static constexpr double kFirstDeviation_px = 6.0;

  FollowerSettings settings_;
  FeatureTrails trails_;
  PatchTracker tracker_;
  std::vector<FollowedFeature> features_;
  std::vector<std::uint8_t> before_pixels_;
  GreyImage before_;        // the frame before; without pixels until there was one
  NeighbourMotion motion_;  // of this frame
  CommonMotion return_;     // of those of a place that come back, or of a layout
  PastLayouts layouts_;
  PictureValidity validity_;
  OverlayWatch overlays_;
  SeenPlaces places_;
  struct Recent {
    Thumbnail picture;
    std::uint64_t trail_place = 0;
  };
  std::array<Recent, 3> recent_{};  // pictures of the last half second
  std::vector<double> scratch_;
  double deviation_px_;
  double strangeness_px_ = 1.0;  // how far a displacement usually is from that of the neighbours
  std::uint32_t next_id_ = 1;
  int blind_frames_ = 0;  // in a row
};

}  // namespace perimap
