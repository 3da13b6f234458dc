// Of FeatureFollower: what vanishes together, and comes back together.
#include <algorithm>

#include "core/following/feature_follower.hpp"

namespace perimap {
namespace {

bool is_away(const FollowedFeature& feature, int place) noexcept { return feature.swept && feature.place == place; }

}  // namespace

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
    feature.patch.forget_faded();
    feature.layout = layout_before(feature, 0);
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

// What goes with those around it, and how many those are. The looks alone would lead many to a place beside their own.
std::size_t FeatureFollower::take_back(const GreyImage& image, int place) noexcept {
  constexpr double kOff_px = 1.5;
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place) || feature.found) continue;
    (void)seek(image, feature, return_.at(feature.last_px), kFirstDeviation_px, settings_.recalled_correlation, true,
               return_.shape());
  }
  if (agree_on_return(image, place) < CommonMotion::kFewest) return 0;
  std::size_t taken = 0;
  for (FollowedFeature& feature : features_) {
    if (!is_away(feature, place)) continue;
    if (feature.found && (feature.px - return_.at(feature.last_px, &feature.last_px)).norm() <= kOff_px) {
      feature.is_recalled = true;
      ++taken;
    } else {
      disbelieve(feature);
    }
  }
  for (FollowedFeature& feature : features_) feature.swept = feature.swept && !feature.is_recalled;
  return taken;
}

// When a good share of what is sought has moved alike, all are, and a good share of them must be taken back then: in a
// blur a few that were sought widely agree by chance. What is nearer to the lens than other tissue has moved otherwise:
// those that do not go with the first motion are asked for another.
bool FeatureFollower::recall_place(const GreyImage& image, int place, const Thumbnail& now) noexcept {
  constexpr std::size_t kFewestAlike = 6, kShareAlike = 4;  // one in so many at least
  constexpr int kMotions = 3;
  const auto is_of_place = [place](const FollowedFeature& feature) { return is_away(feature, place); };
  const auto away = static_cast<std::size_t>(std::count_if(features_.begin(), features_.end(), is_of_place));
  if (away == 0) return false;
  return_.begin_with(displacement_between(places_[place], now).value_or(Vector2d::Zero()));
  const std::size_t probed = probe(image, place);
  std::size_t alike = agree_on_return(image, place);
  const bool seem_back = alike >= kFewestAlike && kShareAlike * alike >= probed;
  std::size_t taken = 0;
  for (int motion = 0; seem_back && motion < kMotions && alike >= kFewestAlike; ++motion) {
    taken += take_back(image, place);
    probe(image, place);
    alike = agree_on_return(image, place);
  }
  const bool are_back = taken >= kFewestAlike && kShareAlike * taken >= away;
  for (FollowedFeature& feature : features_) {
    const bool is_taken = feature.place == place && feature.is_recalled;
    if (!is_away(feature, place) && !is_taken) continue;
    if (is_taken && are_back) continue;
    feature.is_recalled = false;
    feature.swept = !are_back;
    disbelieve(feature);
  }
  return are_back;
}

}  // namespace perimap
