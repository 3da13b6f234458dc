// What one followed feature looks like: as it was first seen, and as it looked last.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// Tissue changes its looks within seconds: it is stretched, lit from elsewhere, wetted. A template of the first view
// does not drift but soon stops fitting; one of the frame before fits and drifts, by a match's deviation a frame. So
// both are kept (Matthews, Ishikawa & Baker, "The template update problem", IEEE PAMI 26(6), 2004): the last view finds
// the place, and the first one, whenever it fits well there, corrects it.
//
// The last view moves without changing its shape. A place that it finds counts when the way back ends where it began
// (way_back.hpp).
//
// Between them are views of half a second to a second ago. One that still fits takes back what the last views have
// drifted since, so that drift sums up from one of those to the next, and no longer from frame to frame. They were made
// before whatever covered the place began to, and so find what comes back.
class FollowedPatch {
 public:
  // Of the first view, at px.
  void begin(const PatchTemplate& first, const Vector2d& px) noexcept;

  struct Search {
    Vector2d predicted_px = Vector2d::Zero();
    double deviation_px = 0;      // of the prediction, per axis
    double min_correlation = 0;   // asked for beside the tracker's own
    bool is_vouched_for = false;  // others tell where it is: the first view need fit no better than the last one
    // The frame before and where the feature was found in it; null when it was not: then there is no way back.
    const GreyImage* before = nullptr;
    Vector2d before_px = Vector2d::Zero();
    Matrix2d reshaped_by = Matrix2d::Identity();  // since it was last found
  };
  // Where it is in the image. Places are noted with MatchState::kFound alone.
  [[nodiscard]] PatchMatch find(const PatchTracker& tracker, const GreyImage& image, const Search& search) noexcept;

  // The view of the place just found becomes the last one. Without a template to be had there, the one before stays.
  void keep_view(const GreyImage& image, const PatchMatch& match, const PatchKernels& kernels) noexcept;

  // The last view, of this frame, is kept beside those that follow.
  void settle_view(std::uint64_t frame) noexcept;
  // Views of later frames are forgotten: they may show what covers the place.
  void forget_since(std::uint64_t frame) noexcept;
  // So are those that show less than an older one does: they were made through fog or in a blur.
  void forget_faded() noexcept;

  // How far the way back has ended from where it began, px, when it was last gone.
  [[nodiscard]] double back_px() const noexcept { return back_px_; }
  // How far the followed point may have drifted since the first view fitted, standard deviation, px.
  [[nodiscard]] double drift_px() const noexcept;

  // All but the templates: what is not believed is put back. To be done before keep_view().
  struct Places {
    PatchState first, last;
    double drift_px2 = 0;
  };
  [[nodiscard]] Places places() const noexcept { return {first_state_, last_state_, drift_px2_}; }
  void put_back(const Places& places) noexcept;

 private:
  struct SettledView {
    PatchTemplate view;
    std::uint64_t frame = 0;
    double drift_px2 = 0;  // up to then
  };
  // Where a view has it.
  struct Sighting {
    PatchMatch match;
    PatchState state;
    double drift_px2 = 0;
    bool is_first = false;  // the first view's
  };

  [[nodiscard]] bool comes_back(const PatchTracker& tracker, const GreyImage& image, const Search& search,
                                const PatchMatch& match) noexcept;
  void correct_drift(const PatchTracker& tracker, const GreyImage& image, PatchMatch& match) noexcept;
  [[nodiscard]] std::optional<Sighting> by_first_view(const PatchTracker& tracker, const GreyImage& image,
                                                      const Vector2d& px, double deviation_px,
                                                      const Matrix2d& reshaped_by, double fits) const noexcept;
  [[nodiscard]] std::optional<Sighting> by_settled_view(const PatchTracker& tracker, const GreyImage& image,
                                                        const SettledView& settled, const Vector2d& px,
                                                        double deviation_px, const Matrix2d& reshaped_by,
                                                        double fits) const noexcept;
  void accept(const Sighting& sighting) noexcept;
  void forget_newest() noexcept;
  void last_as_settled() noexcept;

  PatchTemplate first_, last_;
  std::array<SettledView, 2> settled_;  // the newer first
  std::size_t settled_views_ = 0;
  PatchState first_state_, last_state_;
  bool has_last_ = false;  // else the first view is the last one
  double drift_px2_ = 0;
  double back_px_ = 0;
};

}  // namespace perimap
