#include "core/following/followed_patch.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/way_back.hpp"

namespace perimap {
namespace {

// Of the first view, where it may take over: one that fits worse tells no better than the last one where it is.
constexpr double kFirstViewFits = 0.98;

}  // namespace

void FollowedPatch::begin(const PatchTemplate& first, const Vector2d& px) noexcept {
  first_ = first;
  first_state_ = last_state_ = PatchState{};
  first_state_.px = px;
  has_last_ = false;
  settled_views_ = 0;
  drift_px2_ = back_px_ = 0;
}

double FollowedPatch::drift_px() const noexcept { return std::sqrt(drift_px2_); }

void FollowedPatch::put_back(const Places& places) noexcept {
  first_state_ = places.first;
  last_state_ = places.last;
  drift_px2_ = places.drift_px2;
}

PatchMatch FollowedPatch::find(const PatchTracker& tracker, const GreyImage& image, const Search& search) noexcept {
  const Matrix2d covariance = search.deviation_px * search.deviation_px * Matrix2d::Identity();
  PatchState state = has_last_ ? last_state_ : first_state_;
  state.A = search.reshaped_by * state.A;
  PatchMatch match = tracker.track(image, has_last_ ? last_ : first_, state, search.predicted_px, covariance);
  if (match.state == MatchState::kFound && match.correlation < search.min_correlation) {
    match.state = MatchState::kLowCorrelation;
  }
  if (match.state == MatchState::kFound && search.before != nullptr && !comes_back(tracker, image, search, match)) {
    match.state = MatchState::kTooFar;
  }
  if (match.state == MatchState::kFound) {
    if (has_last_) {
      last_state_ = state;
      drift_px2_ += larger_eigenvalue(match.covariance_px2);
      correct_by_first_view(tracker, image, match);
    } else {
      first_state_ = state;
    }
    return match;
  }
  if (!has_last_) return match;
  // What has been covered, or has gone and come back, may look as it did at first.
  PatchState first = first_state_;
  first.A = search.reshaped_by * first.A;
  PatchMatch again = tracker.track(image, first_, first, search.predicted_px, covariance);
  const double fits = search.is_vouched_for ? search.min_correlation : std::max(search.min_correlation, kFirstViewFits);
  if (again.state == MatchState::kFound && again.correlation >= fits) {
    first_state_ = first;
    drift_px2_ = 0;
    return again;
  }
  if (search.before != nullptr || settled_views_ < settled_.size()) return match;
  PatchState settled;
  settled.A = search.reshaped_by;
  PatchMatch back = tracker.track(image, settled_.back(), settled, search.predicted_px, covariance);
  if (back.state != MatchState::kFound || back.correlation < search.min_correlation) return match;
  last_state_ = settled;
  drift_px2_ += larger_eigenvalue(back.covariance_px2);
  return back;
}

bool FollowedPatch::comes_back(const PatchTracker& tracker, const GreyImage& image, const Search& search,
                               const PatchMatch& match) noexcept {
  const auto off_px = off_on_way_back(tracker, image, match.px,
                                      {*search.before, search.before_px, search.predicted_px, search.deviation_px});
  if (!off_px) return false;
  back_px_ = *off_px;
  return back_px_ < kMostOffOnWayBack_px;
}

void FollowedPatch::correct_by_first_view(const PatchTracker& tracker, const GreyImage& image,
                                          PatchMatch& match) noexcept {
  constexpr double kLeast_px = 0.7;  // of what the two views of one place may differ by
  PatchState state = first_state_;
  const double variance = drift_px2_ + kLeast_px * kLeast_px;
  const PatchMatch first = tracker.track(image, first_, state, match.px, variance * Matrix2d::Identity());
  if (first.state != MatchState::kFound || first.correlation < kFirstViewFits) return;
  first_state_ = state;
  drift_px2_ = 0;
  match = first;
}

void FollowedPatch::keep_view(const GreyImage& image, const PatchMatch& match, const PatchKernels& kernels) noexcept {
  PatchTemplate view;
  if (!make_view(image, match.px, kernels, view)) return;
  last_ = view;
  last_state_ = PatchState{};
  last_state_.px = match.px;
  has_last_ = true;
}

void FollowedPatch::settle_view() noexcept {
  if (!has_last_) return;
  settled_.back() = settled_.front();
  settled_.front() = last_;
  settled_.front().is_of_frame_before = false;
  settled_views_ = std::min(settled_views_ + 1, settled_.size());
}

}  // namespace perimap
