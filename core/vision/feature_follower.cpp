#include "core/vision/feature_follower.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kFirstDeviation_px = 6.0;
constexpr std::size_t kEnoughDisplacements = 4;

bool is_sought(const FollowedFeature& feature) noexcept {
  return feature.state == FollowState::kCandidate || feature.state == FollowState::kTracked;
}

double largest_deviation(const Matrix2d& C) noexcept {
  return std::sqrt(0.5 * (C(0, 0) + C(1, 1)) + std::hypot(0.5 * (C(0, 0) - C(1, 1)), C(0, 1)));
}

}  // namespace

FeatureFollower::FeatureFollower(const FollowerSettings& settings)
    : settings_(settings),
      tracker_({.min_correlation = settings.min_correlation}),
      features_(static_cast<std::size_t>(std::max(settings.maximum, 0))),
      motion_(features_.size()),
      deviation_px_(kFirstDeviation_px) {
  scratch_.reserve(features_.size());
}

int FeatureFollower::free() const noexcept {
  return static_cast<int>(std::count_if(features_.begin(), features_.end(), [](const FollowedFeature& feature) {
    return feature.state == FollowState::kEmpty;
  }));
}

bool FeatureFollower::seek(const GreyImage& image, FollowedFeature& feature, const Vector2d& predicted,
                           double deviation_px, double min_correlation) const noexcept {
  PatchState state = feature.patch_state;
  const Matrix2d covariance = deviation_px * deviation_px * Matrix2d::Identity();
  feature.match = tracker_.track(image, feature.patch, state, predicted, covariance);
  feature.found = feature.match.state == MatchState::kFound && feature.match.correlation >= min_correlation &&
                  largest_deviation(feature.match.covariance_px2) <= settings_.largest_deviation_px;
  if (!feature.found) return false;
  feature.patch_state = state;
  feature.px = feature.match.px;
  return true;
}

void FeatureFollower::note_displacements() noexcept {
  motion_.clear();
  for (const FollowedFeature& feature : features_) {
    if (feature.found) motion_.add(feature.last_px, feature.px);
  }
}

NeighbourMotion::Around FeatureFollower::around(const Vector2d& px, const FollowedFeature* but) const noexcept {
  NeighbourMotion::Around result = motion_.around(px, but != nullptr ? &but->last_px : nullptr);
  if (!result.known && but != nullptr) result.by = but->velocity_px;
  return result;
}

void FeatureFollower::follow(const GreyImage& image) noexcept {
  std::size_t sought = 0, found = 0;
  for (FollowedFeature& feature : features_) {
    feature.found = false;
    feature.last_px = feature.px;
  }
  for (FollowedFeature& feature : features_) {
    if (!is_sought(feature)) continue;
    ++sought;
    const double deviation_px = feature.frames < 2 ? std::max(deviation_px_, kFirstDeviation_px) : deviation_px_;
    found += seek(image, feature, feature.last_px + feature.velocity_px, deviation_px, 0) ? 1 : 0;
  }
  note_displacements();

  const bool has_jerked = 2 * found < sought;
  if (has_jerked) {
    for (FollowedFeature& feature : features_) {
      if (!is_sought(feature) || feature.found) continue;
      (void)seek(image, feature, feature.last_px + displacement_around(feature.last_px, &feature),
                 settings_.widest_deviation_px, settings_.recovered_correlation);
    }
    note_displacements();
  }

  scratch_.clear();
  for (const FollowedFeature& feature : features_) {
    if (!is_sought(feature) || !feature.found || feature.frames < 2) continue;
    const Vector2d off = feature.px - feature.last_px - feature.velocity_px;
    scratch_.push_back(off.norm());
  }
  if (scratch_.size() >= kEnoughDisplacements) {
    // A normal error along each axis has a median norm of 1.18 deviations; tissue errs with longer tails.
    constexpr double kDeviationsPerMedian = 2.0, kShareOfNew = 0.4;
    const double lately = std::clamp(kDeviationsPerMedian * upper_median(scratch_.begin(), scratch_.end()),
                                     settings_.least_deviation_px, settings_.widest_deviation_px);
    deviation_px_ += (lately > deviation_px_ ? 1.0 : kShareOfNew) * (lately - deviation_px_);
  }
  find_again(image);
  judge(image);
  drop_doubles();
}

// What its own velocity did not find, and what was occluded: with the displacement of what is around it.
void FeatureFollower::find_again(const GreyImage& image) noexcept {
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty || feature.found) continue;
    const Vector2d expected = feature.last_px + displacement_around(feature.last_px, &feature);
    const bool is_occluded = feature.state == FollowState::kOccluded;
    // Unseen for long, the place has been carried along without a measurement.
    const double deviation_px = std::min(2 * deviation_px_ + 0.1 * feature.misses, settings_.widest_deviation_px);
    constexpr double kLessThanUsual = 0.03;
    const double min_correlation =
        std::max(settings_.recovered_correlation, feature.usual_correlation - kLessThanUsual);
    if (!seek(image, feature, expected, deviation_px, is_occluded ? min_correlation : 0)) {
      feature.px = expected;
    }
  }
}

void FeatureFollower::judge(const GreyImage& image) noexcept {
  note_displacements();
  scratch_.clear();
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty) continue;
    if (!feature.found) {
      ++feature.misses;
      feature.velocity_px = feature.px - feature.last_px;
      const bool is_outside = feature.px.x() < 0 || feature.px.y() < 0 || feature.px.x() > image.width - 1 ||
                              feature.px.y() > image.height - 1;
      constexpr int kMissesOfCandidate = 2;
      const bool is_candidate = feature.state == FollowState::kCandidate;
      if (is_candidate && feature.misses <= kMissesOfCandidate) continue;
      if (is_candidate || feature.misses > settings_.occluded_frames ||
          (is_outside && feature.misses > settings_.occluded_frames / 4)) {
        feature.state = FollowState::kEmpty;
      } else {
        feature.state = FollowState::kOccluded;
      }
      continue;
    }
    feature.velocity_px =
        feature.misses == 0 ? Vector2d(feature.px - feature.last_px) : displacement_around(feature.px, &feature);
    const bool is_back = feature.misses > 0;
    feature.misses = 0;
    ++feature.frames;
    if (feature.state == FollowState::kOccluded) feature.state = FollowState::kTracked;

    const bool is_candidate = feature.state == FollowState::kCandidate;
    if (!moves_with_neighbours(feature, is_back)) {
      feature.state = FollowState::kEmpty;
      continue;
    }
    if (is_candidate && feature.frames >= settings_.candidate_frames) feature.state = FollowState::kTracked;
    renew_worn_template(image, feature);
  }
  if (scratch_.size() >= kEnoughDisplacements) {
    constexpr double kShareOfNew = 0.2, kLeast_px = 0.4;
    strangeness_px_ +=
        kShareOfNew * (std::max(kLeast_px, upper_median(scratch_.begin(), scratch_.end())) - strangeness_px_);
  }
}

// Jumps and steady sliding: along an edge, on an instrument, with a highlight. Tissue strains, so neighbours differ
// within bounds.
bool FeatureFollower::moves_with_neighbours(FollowedFeature& feature, bool is_back) noexcept {
  const NeighbourMotion::Around neighbours = around(feature.last_px, &feature);
  const Vector2d astray = feature.px - feature.last_px - neighbours.by;
  scratch_.push_back(astray.norm());
  // Of the distance to the neighbours: what a beat strains the tissue by, in a frame and in all.
  constexpr double kStrainOfFrame = 0.06, kStrain = 0.35;
  const bool is_strange =
      astray.norm() > 4 * strangeness_px_ + 0.25 * neighbours.by.norm() + kStrainOfFrame * neighbours.distance_px;
  feature.strange = std::max(0, feature.strange + (is_strange ? 2 : -1));
  constexpr int kMostStrangeCandidate = 5, kMostStrange = 20;
  if (feature.strange > (feature.state == FollowState::kCandidate ? kMostStrangeCandidate : kMostStrange)) return false;
  // What comes back makes up for a place that was only guessed.
  constexpr double kForgetting = 0.03, kMostAstray_px = 4, kMostAstrayOfStrangeness = 6;
  feature.astray_px = is_back ? Vector2d::Zero() : Vector2d((1 - kForgetting) * feature.astray_px + astray);
  return feature.astray_px.norm() <=
         kMostAstray_px + kMostAstrayOfStrangeness * strangeness_px_ + kStrain * neighbours.distance_px;
}

void FeatureFollower::renew_worn_template(const GreyImage& image, FollowedFeature& feature) const noexcept {
  constexpr double kSmoothing = 1.0 / 15, kSteady = 0.02, kWorn = 0.93;
  constexpr int kWornFrames = 10;
  const double correlation = feature.match.correlation;
  const bool is_steady = std::abs(correlation - feature.usual_correlation) < kSteady;
  feature.usual_correlation += kSmoothing * (correlation - feature.usual_correlation);
  const bool is_worn = (correlation < kWorn && is_steady) || template_is_stale(feature.patch_state);
  feature.worn = is_worn ? feature.worn + 1 : 0;
  if (feature.worn < kWornFrames) return;
  feature.worn = 0;
  PatchTemplate renewed;
  if (make_patch_template(image, feature.px, template_settings_, tracker_.kernels(), renewed) !=
      TemplateVerdict::kGood) {
    return;
  }
  feature.patch = renewed;
  feature.patch_state = PatchState{};
  feature.patch_state.px = feature.px;
  feature.usual_correlation = 1;
}

// Two features at one place follow the same tissue, one of them wrongly: the older one stays.
void FeatureFollower::drop_doubles() noexcept {
  constexpr double kApart_px = 3.0;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    if (!features_[i].found) continue;
    for (std::size_t k = i + 1; k < features_.size(); ++k) {
      if (!features_[k].found || (features_[i].px - features_[k].px).squaredNorm() > kApart_px * kApart_px) continue;
      FollowedFeature& younger = features_[i].frames < features_[k].frames ? features_[i] : features_[k];
      younger.state = FollowState::kEmpty;
      younger.found = false;
    }
  }
}

void FeatureFollower::add(const GreyImage& image, std::span<const Vector2d> corners,
                          const TemplateSettings& settings) noexcept {
  template_settings_ = settings;
  auto place = features_.begin();
  PatchTemplate patch;
  for (const Vector2d& px : corners) {
    if (make_patch_template(image, px, template_settings_, tracker_.kernels(), patch) != TemplateVerdict::kGood) {
      continue;
    }
    place = std::find_if(place, features_.end(),
                         [](const FollowedFeature& feature) { return feature.state == FollowState::kEmpty; });
    if (place == features_.end()) return;
    *place = FollowedFeature{};
    place->state = FollowState::kCandidate;
    place->id = next_id_++;
    place->found = true;
    place->px = place->last_px = px;
    place->velocity_px = displacement_around(px, nullptr);
    place->patch = patch;
    place->patch_state.px = px;
    place->match.state = MatchState::kFound;
    place->match.px = px;
    place->match.correlation = 1;
    place->frames = 1;
  }
}

}  // namespace perimap
