#include "core/following/feature_follower.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/following/feature_places.hpp"
#include "core/geometry/symmetric_matrix2.hpp"
#include "core/statistics/upper_median.hpp"
#include "core/vision/grey_histogram.hpp"

namespace perimap {
namespace {

constexpr std::size_t kEnoughDisplacements = 4;

bool is_sought(const FollowedFeature& feature) noexcept {
  return feature.state == FollowState::kCandidate || feature.state == FollowState::kTracked;
}

double largest_deviation(const Matrix2d& C) noexcept { return std::sqrt(larger_eigenvalue(C)); }

// False for a picture without contrast, but for the noise: black, faded, one colour.
bool shows_anything(const GreyImage& image) noexcept {
  constexpr int kStep = 8, kLeastContrast_grey = 8;
  constexpr double kTail = 0.05;
  const GreyHistogram counts(image, kStep);
  return image.height <= kStep / 2 || image.width <= kStep / 2 ||
         counts.quantile(1 - kTail) - counts.quantile(kTail) >= kLeastContrast_grey;
}

}  // namespace

FeatureFollower::FeatureFollower(const FollowerSettings& settings)
    : settings_(settings),
      trails_(settings.rate),
      tracker_({.min_correlation = settings.min_correlation}),
      // Twice as many may be away, here and where the lens has been meanwhile; and as many as are on trial.
      features_(static_cast<std::size_t>((3 + settings.candidates_per_place) * std::max(settings.maximum, 0))),
      motion_(features_.size()),
      return_(features_.size()),
      layouts_(features_.size()),
      validity_(settings.rate),
      overlays_(features_.size(), settings.rate, settings.overlay),
      deviation_px_(kFirstDeviation_px) {
  scratch_.reserve(features_.size());
}

int FeatureFollower::frames(Duration time, int least) const noexcept {
  return std::max(static_cast<int>(settings_.rate.frames(time)), least);
}

std::uint64_t FeatureFollower::settling_frames() const noexcept {
  constexpr Duration kSettledEvery = std::chrono::milliseconds(500);
  return static_cast<std::uint64_t>(frames(kSettledEvery, 1));
}

std::size_t FeatureFollower::frames_to_judge() const noexcept {
  return std::max(static_cast<std::size_t>(FollowedFeature::kTrail * trails_.stride()),
                  static_cast<std::size_t>(frames(settings_.candidate, settings_.candidate_frames)));
}

int FeatureFollower::free() const noexcept {
  const auto filled = std::count_if(features_.begin(), features_.end(),
                                    [](const FollowedFeature& feature) { return feature.fills_place(); });
  return filled_by_features(features_) >= settings_.maximum ? 0
                                                            : std::max(0, most_candidates() - static_cast<int>(filled));
}

std::vector<Vector2d> FeatureFollower::occupied() const {
  std::vector<Vector2d> places;
  for (const FollowedFeature& feature : features_) {
    if (feature.fills_place()) places.push_back(feature.px);
  }
  for (const OverlayWatch::Overlay& overlay : overlays_.overlays()) places.push_back(overlay.px);
  return places;
}

bool FeatureFollower::seek(const GreyImage& image, FollowedFeature& feature, const Vector2d& predicted,
                           double deviation_px, double min_correlation, bool is_vouched_for,
                           const Matrix2d& reshaped_by) const noexcept {
  const bool has_way_back = before_.data != nullptr && feature.misses == 0;
  feature.match = feature.patch.find(tracker_, image,
                                     {.predicted_px = predicted,
                                      .deviation_px = deviation_px,
                                      .min_correlation = min_correlation,
                                      .is_vouched_for = is_vouched_for,
                                      .before = has_way_back ? &before_ : nullptr,
                                      .before_px = feature.last_px,
                                      .reshaped_by = reshaped_by});
  feature.found = feature.match.state == MatchState::kFound;
  if (feature.found) feature.px = feature.match.px;
  return feature.found;
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

// All that was not found at once is sought widely. What was found at once and does not go with what is found then, came
// upon something else where it was expected.
void FeatureFollower::follow_jerk(const GreyImage& image) noexcept {
  for (FollowedFeature& feature : features_) {
    feature.was_found_at_once = feature.found;
    if (!is_sought(feature) || feature.found) continue;
    (void)seek(image, feature, feature.last_px + displacement_around(feature.last_px, &feature),
               settings_.widest_deviation_px, settings_.recovered_correlation);
  }
  note_displacements();
  for (FollowedFeature& feature : features_) {
    if (!is_sought(feature) || !feature.was_found_at_once) continue;
    const NeighbourMotion::Around neighbours = around(feature.last_px, &feature);
    if (!neighbours.known || !is_strange(feature.px - feature.last_px - neighbours.by, neighbours)) continue;
    disbelieve(feature);
    (void)seek(image, feature, feature.last_px + neighbours.by, kFirstDeviation_px, settings_.recovered_correlation);
  }
  note_displacements();
}

void FeatureFollower::track_into(const GreyImage& image) noexcept {
  std::size_t sought = 0, found = 0;
  for (FollowedFeature& feature : features_) {
    feature.found = feature.is_overlay = feature.is_recalled = feature.has_layout = false;
    feature.last_px = feature.px;
    feature.last_places = feature.patch.places();
  }
  if (!shows_anything(image)) {
    ++blind_frames_;
    for (FollowedFeature& feature : features_) feature.velocity_px.setZero();
    return;
  }
  trails_.next_frame();
  validity_.look_at(image);
  if (blind_frames_ > 0) {
    constexpr double kDrift_px_per_s = 15.0;
    const double drift_px = kDrift_px_per_s / settings_.rate.per_s() * blind_frames_;
    deviation_px_ = std::min(std::max(deviation_px_, kFirstDeviation_px) + drift_px, settings_.widest_deviation_px);
  }
  for (FollowedFeature& feature : features_) {
    if (!is_sought(feature)) continue;
    ++sought;
    const double deviation_px = feature.frames < 2 ? std::max(deviation_px_, kFirstDeviation_px) : deviation_px_;
    found += seek(image, feature, feature.last_px + feature.velocity_px, deviation_px, 0) ? 1 : 0;
  }
  note_displacements();

  if (2 * found < sought) follow_jerk(image);
  if (has_vanished()) {
    sweep();
    note_displacements();
  } else {
    recall_swept(image);
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
  hold_against_others(image);
  judge(image);
  drop_doubles(features_);
  promote_the_surest(features_, settings_.maximum);
  keep_to_maximum(features_, settings_.maximum);
  overlays_.let_go(features_, trails_);
  if (trails_.is_due()) trails_.note(features_);
  if (trails_.frame() % settling_frames() == 0) layouts_.note(features_, trails_.frame());
  note_picture(image);
  blind_frames_ = 0;
  remember(image);
}

// A third to half a second ago there is always one.
void FeatureFollower::note_picture(const GreyImage& image) noexcept {
  constexpr std::uint64_t kPlacesApart = 5;
  const std::uint64_t place = trails_.place();
  if (trails_.frame() % (kPlacesApart * trails_.stride()) != 0) return;
  recent_[place / kPlacesApart % recent_.size()] = {thumbnail_of(image), place};
}

void FeatureFollower::disbelieve(FollowedFeature& feature) const noexcept {
  feature.found = false;
  feature.px = feature.last_px;
  feature.patch.put_back(feature.last_places);
}

void FeatureFollower::judge(const GreyImage& image) noexcept {
  // A candidate that is not found again at once was none; a feature may be covered for a while.
  constexpr Duration kMissesOfCandidate = std::chrono::milliseconds(67), kBriefly = std::chrono::milliseconds(100);
  const int misses_of_candidate = frames(kMissesOfCandidate, 2);
  const int briefly = frames(kBriefly, 3);
  const int occluded = frames(settings_.occluded, settings_.occluded_frames);
  const int hidden = frames(settings_.hidden, settings_.occluded_frames);
  const int remembered = frames(settings_.remembered, settings_.occluded_frames);
  const int candidate = frames(settings_.candidate, settings_.candidate_frames);
  constexpr Duration kReturning = std::chrono::milliseconds(400);
  const int returning = frames(kReturning, 5);
  note_displacements();
  scratch_.clear();
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty) continue;
    if (!feature.found) {
      feature.is_away = ++feature.misses > briefly;
      if (feature.misses == 1) feature.layout = layout_before(feature, 0);
      if (feature.misses == briefly + 1) feature.patch.forget_faded();
      feature.hidden += feature.swept || validity_.at(feature.px) != RegionFault::kNone ? 1 : 0;
      feature.velocity_px = feature.px - feature.last_px;
      const bool is_outside = feature.px.x() < 0 || feature.px.y() < 0 || feature.px.x() > image.width - 1 ||
                              feature.px.y() > image.height - 1;
      const bool is_candidate = feature.state == FollowState::kCandidate;
      if (is_candidate && feature.misses <= misses_of_candidate) continue;
      const int missed = feature.misses - feature.hidden, longest = feature.has_layout ? remembered : occluded;
      if (is_candidate || missed > longest || feature.hidden > hidden || (is_outside && missed > longest / 4)) {
        feature.let_go();
      } else {
        feature.state = FollowState::kOccluded;
      }
      continue;
    }
    // Over a gap of unknown length nothing is known of how fast it goes.
    if (blind_frames_ > 0 || feature.is_recalled) {
      feature.velocity_px.setZero();
    } else {
      feature.velocity_px =
          feature.misses == 0 ? Vector2d(feature.px - feature.last_px) : displacement_around(feature.px, &feature);
    }
    const bool is_back = feature.misses > 0 || blind_frames_ > 0;
    const bool is_clear = validity_.at(feature.px) == RegionFault::kNone;
    feature.returning =
        feature.is_away || !is_clear || blind_frames_ > 0 ? returning : std::max(0, feature.returning - 1);
    feature.was_alone = !feature.is_recalled && (feature.was_alone || feature.is_away);
    feature.misses = feature.hidden = 0;
    feature.is_away = false;
    feature.swept = false;
    ++feature.frames;
    if (feature.state == FollowState::kOccluded) feature.state = FollowState::kTracked;

    const bool is_candidate = feature.state == FollowState::kCandidate;
    if (!moves_with_neighbours(feature, is_back)) {
      if (!take_back_stray(feature, briefly)) feature.let_go();
      continue;
    }
    if (is_candidate && feature.frames >= candidate && !overlays_.may_be_overlay(feature, trails_)) {
      feature.is_ripe = true;
    }
    if (is_candidate) feature.doubt_px += largest_deviation(feature.match.covariance_px2) + feature.patch.back_px();
    feature.patch.keep_view(image, feature.match, tracker_.kernels());
    if (trails_.frame() % settling_frames() == 0 && feature.returning == 0) {
      feature.patch.settle_view(trails_.frame());
    }
  }
  if (scratch_.size() >= kEnoughDisplacements) {
    constexpr double kShareOfNew = 0.2, kLeast_px = 0.4;
    strangeness_px_ +=
        kShareOfNew * (std::max(kLeast_px, upper_median(scratch_.begin(), scratch_.end())) - strangeness_px_);
  }
}

// In one frame.
bool FeatureFollower::is_strange(const Vector2d& astray, const NeighbourMotion::Around& neighbours) const noexcept {
  constexpr double kStrainOfFrame = 0.06;  // of the distance to the neighbours: what a beat strains the tissue by
  return astray.norm() > 4 * strangeness_px_ + 0.25 * neighbours.by.norm() +
                             settings_.rate.of_usual() * kStrainOfFrame * neighbours.distance_px;
}

// Jumps and steady sliding: along an edge, on an instrument, with a highlight. Tissue strains, so neighbours differ
// within bounds.
bool FeatureFollower::moves_with_neighbours(FollowedFeature& feature, bool is_back) noexcept {
  const NeighbourMotion::Around neighbours = around(feature.last_px, &feature);
  const Vector2d astray = feature.px - feature.last_px - neighbours.by;
  scratch_.push_back(astray.norm());
  feature.strange = std::max(0, feature.strange + (is_strange(astray, neighbours) ? 2 : -1));
  // It counts up by two: three strange frames, and a third of a second of them.
  constexpr Duration kStrangeCandidate = std::chrono::milliseconds(167), kStrange = std::chrono::milliseconds(667);
  const bool is_candidate = feature.state == FollowState::kCandidate;
  if (feature.strange > (is_candidate ? frames(kStrangeCandidate, 5) : frames(kStrange, 20))) return false;
  // What comes back makes up for a place that was only guessed.
  constexpr double kForgetting = 0.03, kMostAstray_px = 4, kMostAstrayOfStrangeness = 6;
  constexpr double kStrain = 0.35;  // of the distance to the neighbours: what beats strain the tissue by
  const double kept = 1 - settings_.rate.of_usual() * kForgetting;
  feature.astray_px = is_back ? Vector2d::Zero() : Vector2d(kept * feature.astray_px + astray);
  return feature.astray_px.norm() <=
         kMostAstray_px + kMostAstrayOfStrangeness * strangeness_px_ + kStrain * neighbours.distance_px;
}

// For the ways back.
void FeatureFollower::remember(const GreyImage& image) noexcept {
  before_pixels_.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  std::uint8_t* to = before_pixels_.data();
  for (int y = 0; y < image.height; ++y) to = std::copy_n(image.row(y), image.width, to);
  before_ = {before_pixels_.data(), image.width, image.height, image.width};
}

void FeatureFollower::add(const GreyImage& image, std::span<const Vector2d> corners,
                          const TemplateSettings& settings) noexcept {
  remember(image);
  PatchTemplate patch;
  int wanted = free();
  for (const Vector2d& px : corners) {
    if (wanted <= 0) return;
    if (make_patch_template(image, px, settings, tracker_.kernels(), patch) != TemplateVerdict::kGood) {
      continue;
    }
    FollowedFeature* const place = place_for_new(features_);
    if (place == nullptr) return;
    --wanted;
    *place = FollowedFeature{};
    place->state = FollowState::kCandidate;
    place->id = next_id_++;
    place->found = true;
    place->px = place->last_px = px;
    place->velocity_px = displacement_around(px, nullptr);
    place->patch.begin(patch, px);
    place->match.state = MatchState::kFound;
    place->match.px = px;
    place->match.correlation = 1;
    place->frames = 1;
    place->first_px = px;
    place->first_frame = trails_.frame();
    trails_.begin(*place);
  }
}

}  // namespace perimap
