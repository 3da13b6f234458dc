#include "core/following/feature_follower.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/following/birth_layout.hpp"
#include "core/following/feature_places.hpp"
#include "core/geometry/symmetric_matrix2.hpp"
#include "core/statistics/upper_median.hpp"
#include "core/vision/grey_histogram.hpp"

namespace perimap {
namespace {

constexpr double kFirstDeviation_px = 6.0;
constexpr std::size_t kEnoughDisplacements = 4;

bool is_sought(const FollowedFeature& feature) noexcept {
  return feature.state == FollowState::kCandidate || feature.state == FollowState::kTracked;
}

bool is_away(const FollowedFeature& feature, int place) noexcept { return feature.swept && feature.place == place; }

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
      validity_(settings.rate),
      overlays_(features_.size(), settings.rate, settings.overlay),
      deviation_px_(kFirstDeviation_px) {
  scratch_.reserve(features_.size());
}

int FeatureFollower::frames(Duration time, int least) const noexcept {
  return std::max(static_cast<int>(settings_.rate.frames(time)), least);
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

// Near where it is expected, since others vouch for that.
bool FeatureFollower::seek_vouched_for(const GreyImage& image, FollowedFeature& feature, const Vector2d& expected,
                                       double deviation_px) const noexcept {
  constexpr double kOff_px = 2, kOffOfWidth = 0.006;
  const FollowedPatch::Places places = feature.patch.places();
  if (!seek(image, feature, expected, deviation_px, settings_.vouched_correlation, true)) return false;
  const bool is_sure = feature.match.correlation >= settings_.recovered_correlation;
  if (is_sure || (feature.px - expected).norm() <= kOff_px + kOffOfWidth * image.width) return true;
  feature.patch.put_back(places);
  feature.found = false;
  feature.px = feature.last_px;
  return false;
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
    feature.found = feature.is_overlay = feature.is_recalled = false;
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
  note_picture(image);
  blind_frames_ = 0;
  remember(image);
}

// Nearly all of what is tracked. Candidates tell nothing: many of them are none from the beginning.
bool FeatureFollower::has_vanished() const noexcept {
  constexpr std::size_t kEnoughToTell = 8, kNearlyAll = 5;  // one in so many is left at most
  std::size_t tracked = 0, found = 0;
  for (const FollowedFeature& feature : features_) {
    if (feature.state != FollowState::kTracked && !has_lately_been_lost(feature)) continue;
    ++tracked;
    found += feature.found ? 1 : 0;
  }
  return tracked >= kEnoughToTell && kNearlyAll * found < tracked;
}

// A lens that is wiped, or withdrawn, loses them within some frames, not in one.
bool FeatureFollower::has_lately_been_lost(const FollowedFeature& feature) const noexcept {
  constexpr Duration kLately = std::chrono::milliseconds(400);
  return feature.state == FollowState::kOccluded && !feature.swept && feature.misses <= frames(kLately, 5);
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

// They are where they were before it began, as their places of then have it, and so is the picture.
void FeatureFollower::sweep() noexcept {
  const Recent& then = *std::min_element(
      recent_.begin(), recent_.end(), [](const Recent& a, const Recent& b) { return a.trail_place < b.trail_place; });
  const int place = places_.remember(then.picture);
  const std::uint64_t ago = trails_.place() - then.trail_place;
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kCandidate) feature.let_go();
    if (feature.state != FollowState::kTracked && !has_lately_been_lost(feature)) continue;
    disbelieve(feature);
    if (ago > 0 && ago <= feature.trail_length && ago < FollowedFeature::kTrail) {
      feature.px = feature.last_px = trails_.at(feature, static_cast<std::size_t>(ago));
    }
    feature.velocity_px.setZero();
    feature.swept = true;
    feature.place = place;
  }
}

void FeatureFollower::recall_swept(const GreyImage& image) noexcept {
  const auto is_swept = [](const FollowedFeature& feature) { return feature.swept; };
  if (std::none_of(features_.begin(), features_.end(), is_swept)) return;
  const Thumbnail now = thumbnail_of(image);
  for (int place = 0; place < SeenPlaces::kMost; ++place) {
    if (!recall_place(image, place, now)) continue;
    note_displacements();
    return;
  }
}

// Widely, in this frame a share of a place's features. Returns how many those are.
std::size_t FeatureFollower::probe(const GreyImage& image, int place) noexcept {
  constexpr std::size_t kProbes = 40;
  const auto away = static_cast<std::size_t>(std::count_if(
      features_.begin(), features_.end(), [&](const FollowedFeature& feature) { return is_away(feature, place); }));
  const std::size_t stride = (away + kProbes - 1) / kProbes;
  std::size_t nth = stride > 0 ? trails_.frame() % stride : 0, probed = 0;
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place) || nth++ % stride != 0) continue;
    ++probed;
    (void)seek(image, feature, return_.at(feature.last_px), settings_.widest_deviation_px,
               settings_.vouched_correlation, true, return_.shape());
  }
  return probed;
}

// How many of those found have moved alike.
std::size_t FeatureFollower::agree_on_return(const GreyImage& image, int place) noexcept {
  constexpr double kAlike_px = 3, kAlikeOfWidth = 0.006;
  return_.clear();
  for (const FollowedFeature& feature : features_) {
    if (is_away(feature, place) && feature.found) return_.add(feature.last_px, feature.px);
  }
  return return_.agree(kAlike_px + kAlikeOfWidth * image.width);
}

// What goes with those around it. The looks alone would lead many to a place beside their own.
void FeatureFollower::take_back(const GreyImage& image, int place) noexcept {
  constexpr double kOff_px = 1.5;
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place) || feature.found) continue;
    (void)seek(image, feature, return_.at(feature.last_px), kFirstDeviation_px, settings_.recalled_correlation, true,
               return_.shape());
  }
  if (agree_on_return(image, place) < CommonMotion::kFewest) return;
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place)) continue;
    if (feature.found && (feature.px - return_.at(feature.last_px, &feature.last_px)).norm() <= kOff_px) {
      feature.is_recalled = true;
    } else {
      disbelieve(feature);
    }
  }
  for (FollowedFeature& feature : features_) feature.swept = feature.swept && !feature.is_recalled;
}

// When a good share of what is sought has moved alike, all are. What is nearer to the lens than other tissue has moved
// otherwise: those that do not go with the first motion are asked for another.
bool FeatureFollower::recall_place(const GreyImage& image, int place, const Thumbnail& now) noexcept {
  constexpr std::size_t kFewestAlike = 6, kShareAlike = 4;  // one in so many at least
  constexpr int kMotions = 3;
  const auto is_of_place = [place](const FollowedFeature& feature) { return is_away(feature, place); };
  if (std::none_of(features_.begin(), features_.end(), is_of_place)) return false;
  return_.begin_with(displacement_between(places_[place], now).value_or(Vector2d::Zero()));
  const std::size_t probed = probe(image, place);
  std::size_t alike = agree_on_return(image, place);
  const bool are_back = alike >= kFewestAlike && kShareAlike * alike >= probed;
  for (int motion = 0; are_back && motion < kMotions && alike >= kFewestAlike; ++motion) {
    take_back(image, place);
    probe(image, place);
    alike = agree_on_return(image, place);
  }
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place)) continue;
    disbelieve(feature);
    feature.swept = !are_back;
  }
  return are_back;
}

// What its own velocity did not find, and what was occluded: with the displacement of what is around it.
void FeatureFollower::find_again(const GreyImage& image) noexcept {
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty || feature.found || feature.swept) continue;
    const NeighbourMotion::Around neighbours = around(feature.last_px, &feature);
    constexpr double kShareKept = 0.5;  // of a velocity that nothing confirms
    const Vector2d expected = feature.last_px + (neighbours.known ? 1.0 : kShareKept) * neighbours.by;
    const bool is_occluded = feature.state == FollowState::kOccluded;
    // Unseen for long, the place has been carried along without a measurement.
    constexpr double kDrift_px_per_s = 3.0;
    const double deviation_px = std::min(2 * deviation_px_ + kDrift_px_per_s / settings_.rate.per_s() * feature.misses,
                                         settings_.widest_deviation_px);
    // What its region hid comes back with what is around it.
    const bool is_vouched_for = is_occluded && feature.hidden > 0 && neighbours.known;
    const bool is_found = is_vouched_for ? seek_vouched_for(image, feature, expected, deviation_px)
                                         : seek(image, feature, expected, deviation_px,
                                                is_occluded ? settings_.recovered_correlation : 0);
    if (!is_found) feature.px = expected;
  }
}

// What was away and has come back alone: many places look like one that has not been seen for long.
void FeatureFollower::hold_against_others(const GreyImage& image) noexcept {
  constexpr double kAlikeOfWidth = 0.03, kOff_px = 3, kOffOfWidth = 0.015;
  for (FollowedFeature& feature : features_) {
    if (!feature.found || !feature.is_away || feature.is_recalled) continue;
    const auto off_px = off_among_its_own(features_, feature, kAlikeOfWidth * image.width, return_);
    if (off_px && *off_px > kOff_px + kOffOfWidth * image.width) disbelieve(feature);
  }
}

void FeatureFollower::judge(const GreyImage& image) noexcept {
  // A candidate that is not found again at once was none; a feature may be covered for a while.
  constexpr Duration kMissesOfCandidate = std::chrono::milliseconds(67), kBriefly = std::chrono::milliseconds(100);
  const int misses_of_candidate = frames(kMissesOfCandidate, 2);
  const int briefly = frames(kBriefly, 3);
  const int occluded = frames(settings_.occluded, settings_.occluded_frames);
  const int hidden = frames(settings_.hidden, settings_.occluded_frames);
  const int candidate = frames(settings_.candidate, settings_.candidate_frames);
  constexpr Duration kSettledEvery = std::chrono::milliseconds(500);
  const auto view_stride = static_cast<std::uint64_t>(frames(kSettledEvery, 1));
  note_displacements();
  scratch_.clear();
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty) continue;
    if (!feature.found) {
      feature.is_away = ++feature.misses > briefly;
      feature.hidden += feature.swept || validity_.at(feature.px) != RegionFault::kNone ? 1 : 0;
      feature.velocity_px = feature.px - feature.last_px;
      const bool is_outside = feature.px.x() < 0 || feature.px.y() < 0 || feature.px.x() > image.width - 1 ||
                              feature.px.y() > image.height - 1;
      const bool is_candidate = feature.state == FollowState::kCandidate;
      if (is_candidate && feature.misses <= misses_of_candidate) continue;
      const int missed = feature.misses - feature.hidden;
      if (is_candidate || missed > occluded || feature.hidden > hidden || (is_outside && missed > occluded / 4)) {
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
    feature.misses = feature.hidden = 0;
    feature.is_away = false;
    feature.swept = false;
    ++feature.frames;
    if (feature.state == FollowState::kOccluded) feature.state = FollowState::kTracked;

    const bool is_candidate = feature.state == FollowState::kCandidate;
    if (!moves_with_neighbours(feature, is_back)) {
      feature.let_go();
      continue;
    }
    if (is_candidate && feature.frames >= candidate && !overlays_.may_be_overlay(feature, trails_)) {
      feature.is_ripe = true;
    }
    if (is_candidate) feature.doubt_px += largest_deviation(feature.match.covariance_px2) + feature.patch.back_px();
    feature.patch.keep_view(image, feature.match, tracker_.kernels());
    if (trails_.frame() % view_stride == 0 && validity_.at(feature.px) == RegionFault::kNone)
      feature.patch.settle_view();
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
