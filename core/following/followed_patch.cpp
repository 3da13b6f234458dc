#include "core/following/followed_patch.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/vision/way_back.hpp"

namespace perimap {
namespace {

// Of the first view, where it may take over: one that fits worse tells no better than the last one where it is.
constexpr double kFirstViewFits = 0.98;

// How well it tells where it is.
double texture_of(const PatchTemplate& view) noexcept {
  const auto& inverse = view.levels[0].translation_inverse;
  return 1 / (inverse[0] + inverse[3]);
}

bool has_faded(const PatchTemplate& view, const PatchTemplate& since) noexcept {
  constexpr double kLeastKept = 0.6;
  return texture_of(view) < kLeastKept * texture_of(since);
}

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
  if (match.state == MatchState::kFound && search.before != nullptr) {
    if (has_last_) {
      last_state_ = state;
      drift_px2_ += larger_eigenvalue(match.covariance_px2);
      correct_drift(tracker, image, match);
    } else {
      first_state_ = state;
    }
    return match;
  }
  // What has been covered, or has gone and come back, may look as it did at first or lately. Of all views that one is
  // believed which fits best: the last one may show what came over the place.
  std::optional<Sighting> best;
  if (match.state == MatchState::kFound) {
    best = Sighting{match, state, has_last_ ? drift_px2_ + larger_eigenvalue(match.covariance_px2) : 0, !has_last_};
  }
  const auto consider = [&best](const std::optional<Sighting>& other) {
    if (other && (!best || other->match.correlation > best->match.correlation)) best = other;
  };
  if (has_last_) {
    const double fits =
        search.is_vouched_for ? search.min_correlation : std::max(search.min_correlation, kFirstViewFits);
    consider(by_first_view(tracker, image, search.predicted_px, search.deviation_px, search.reshaped_by, fits));
  }
  for (std::size_t i = 0; i < settled_views_ && search.before == nullptr; ++i) {
    consider(by_settled_view(tracker, image, settled_[i], search.predicted_px, search.deviation_px, search.reshaped_by,
                             search.min_correlation));
  }
  if (!best) return match;
  accept(*best);
  if (!best->is_first) correct_drift(tracker, image, best->match);
  return best->match;
}

std::optional<FollowedPatch::Sighting> FollowedPatch::by_first_view(const PatchTracker& tracker, const GreyImage& image,
                                                                    const Vector2d& px, double deviation_px,
                                                                    const Matrix2d& reshaped_by,
                                                                    double fits) const noexcept {
  Sighting sighting{{}, first_state_, 0, true};
  sighting.state.A = reshaped_by * sighting.state.A;
  sighting.match = tracker.track(image, first_, sighting.state, px, deviation_px * deviation_px * Matrix2d::Identity());
  if (sighting.match.state != MatchState::kFound || sighting.match.correlation < fits) return std::nullopt;
  return sighting;
}

std::optional<FollowedPatch::Sighting> FollowedPatch::by_settled_view(const PatchTracker& tracker,
                                                                      const GreyImage& image,
                                                                      const SettledView& settled, const Vector2d& px,
                                                                      double deviation_px, const Matrix2d& reshaped_by,
                                                                      double fits) const noexcept {
  Sighting sighting;
  sighting.state.A = reshaped_by;
  sighting.match =
      tracker.track(image, settled.view, sighting.state, px, deviation_px * deviation_px * Matrix2d::Identity());
  if (sighting.match.state != MatchState::kFound || sighting.match.correlation < fits) return std::nullopt;
  sighting.drift_px2 = settled.drift_px2 + larger_eigenvalue(sighting.match.covariance_px2);
  return sighting;
}

void FollowedPatch::accept(const Sighting& sighting) noexcept {
  drift_px2_ = sighting.drift_px2;
  (sighting.is_first ? first_state_ : last_state_) = sighting.state;
}

bool FollowedPatch::comes_back(const PatchTracker& tracker, const GreyImage& image, const Search& search,
                               const PatchMatch& match) noexcept {
  const auto off_px = off_on_way_back(tracker, image, match.px,
                                      {*search.before, search.before_px, search.predicted_px, search.deviation_px});
  if (!off_px) return false;
  back_px_ = *off_px;
  return back_px_ < kMostOffOnWayBack_px;
}

// The first view, and where it does not fit, the older of the others: it has drifted least.
void FollowedPatch::correct_drift(const PatchTracker& tracker, const GreyImage& image, PatchMatch& match) noexcept {
  constexpr double kLeast_px = 0.7;  // of what the two views of one place may differ by
  const auto deviation_since = [&](double drift_px2) {
    return std::sqrt(std::max(0.0, drift_px2_ - drift_px2) + kLeast_px * kLeast_px);
  };
  auto by = by_first_view(tracker, image, match.px, deviation_since(0), Matrix2d::Identity(), kFirstViewFits);
  for (std::size_t i = settled_views_; i-- > 0 && !by;) {
    const SettledView& settled = settled_[i];
    by = by_settled_view(tracker, image, settled, match.px, deviation_since(settled.drift_px2), Matrix2d::Identity(),
                         kFirstViewFits);
  }
  if (!by) return;
  accept(*by);
  match = by->match;
}

void FollowedPatch::keep_view(const GreyImage& image, const PatchMatch& match, const PatchKernels& kernels) noexcept {
  PatchTemplate view;
  if (!make_view(image, match.px, kernels, view)) return;
  last_ = view;
  last_state_ = PatchState{};
  last_state_.px = match.px;
  has_last_ = true;
}

void FollowedPatch::settle_view(std::uint64_t frame) noexcept {
  if (!has_last_) return;
  std::copy_backward(settled_.begin(), settled_.end() - 1, settled_.end());
  settled_.front() = {last_, frame, drift_px2_};
  settled_.front().view.is_of_frame_before = false;
  settled_views_ = std::min(settled_views_ + 1, settled_.size());
}

void FollowedPatch::forget_newest() noexcept {
  std::copy(settled_.begin() + 1, settled_.end(), settled_.begin());
  --settled_views_;
}

void FollowedPatch::forget_since(std::uint64_t frame) noexcept {
  while (settled_views_ > 0 && settled_.front().frame > frame) forget_newest();
  last_as_settled();
}

void FollowedPatch::forget_faded() noexcept {
  while (settled_views_ > 1 && has_faded(settled_.front().view, settled_[settled_views_ - 1].view)) forget_newest();
  if (has_last_ && settled_views_ > 0 && has_faded(last_, settled_.front().view)) last_as_settled();
}

void FollowedPatch::last_as_settled() noexcept {
  has_last_ = settled_views_ > 0;
  if (!has_last_) return;
  last_ = settled_.front().view;
  last_state_ = PatchState{};
  drift_px2_ = settled_.front().drift_px2;
}

}  // namespace perimap
