#include "core/pipeline/organ_watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace perimap {
namespace {

// What a frame's matches are asked for: displacements of about so much, beside the tracker's error.
constexpr double kSearchedShift_mm = 10.0;
constexpr double kSearchedTurn_rad = 0.05;
// No tracker and no map is better than that.
constexpr double kLeastTracker_mm = 0.1;
constexpr double kLeastTracker_rad = 3e-4;
constexpr double kLeastMap_mm = 0.2;

// Beyond chance: see docs/decisions/0097. And what makes it the organ's place again.
constexpr double kDoubt_chi2 = 35.0;
constexpr double kDoubt_mm = 1.2;
// Half a second is less than a heart beat: what the map errs by at one phase does not average out in it.
constexpr double kWithinABeat = 2.0;  // times the chi-squared
constexpr double kUnsurePhase_s = 0.02;
constexpr double kBack_mm = 1.0;
constexpr double kBack_chi2 = 25.0;
constexpr std::size_t kFollowedWindow = 0;  // of CommonDisplacement::kWindows
constexpr std::size_t kBackWindows[] = {1, 2};
constexpr std::size_t kProofWindow = 1;

// So much the organ may move until the next frames tell; and so far the map is looked for where it is not found.
constexpr double kMoving_mm = 1.5;
constexpr double kLost_mm = 5.0;
constexpr int kFewestExpected = 8;
constexpr int kFewestSeen = 5;
constexpr Duration kOutOfSight = std::chrono::seconds(2);

// A map is moved by what two seconds tell so well, where four and half a second tell the same.
constexpr std::size_t kRestWindow = 2;
constexpr std::size_t kBeforeRestWindow = 3;
constexpr double kRest_mm = 1.0;
constexpr double kRestsWithin_deviations = 1.5;
constexpr Duration kRestIsOld = std::chrono::milliseconds(300);

// The tool is asked over these windows, shorter ones first: what moves is told by them, what is small by longer ones.
constexpr std::size_t kToolWindows[] = {1, 2, 3};
// A tool rests that has lately moved by less than that.
constexpr double kToolRests_mm = 0.5;

CameraPose wider(const CameraPose& pose, double shift_mm, double turn_rad) noexcept {
  CameraPose wide = pose;
  wide.position_variance_mm2 += shift_mm * shift_mm;
  wide.rotation_variance_rad2 += turn_rad * turn_rad;
  return wide;
}

}  // namespace

CameraPose OrganWatch::pose_by_map(const CameraPose& told) noexcept {
  known_.told = told;
  if (!displaced() || !told.valid()) return told;
  CameraPose pose = told;
  const Pose X_MW = displacement().inverse();
  pose.X_WC = X_MW * told.X_WC;
  pose.lever_W_mm = X_MW.R * told.lever_W_mm;
  pose.position_variance_mm2 += kMoving_mm * kMoving_mm;
  return pose;
}

double OrganWatch::search_deviation_mm() const noexcept { return displaced_.frames_lost > 0 ? kLost_mm : 0.0; }

void OrganWatch::count_sight(std::span<FeatureGroup> groups, Instant capture) noexcept {
  int expected = 0;
  int agreeing = 0;
  for (FeatureGroup& group : groups) {
    for (const FeatureSlot& slot : group.slots()) {
      if (!is_asked(slot, Asked::kWellKnown) || slot.shed || !slot.in_view) continue;
      ++expected;
      agreeing += slot.match_agrees ? 1 : 0;
    }
  }
  const bool lost = expected >= kFewestExpected && 2 * agreeing < expected;
  displaced_.frames_lost = lost ? displaced_.frames_lost + 1 : 0;
  if (agreeing < kFewestSeen) return;
  // Whoever moved it meanwhile was not seen.
  if (known_.seen && capture - *known_.seen > kOutOfSight) {
    evidence_.clear();
    known_.unproven = true;
    known_.settling = false;
    tool_.heed_organ(false, capture);
  }
  known_.seen = capture;
}

void OrganWatch::watch(ImagePhase& image, std::span<FeatureGroup> groups, const FrameRecord& frame) noexcept {
  if (frame.stamp.capture - displaced_.judged > kRestIsOld) displaced_.resting.reset();
  if (!frame.measurable) return;
  count_sight(groups, frame.stamp.capture);
  CameraPose told = frame.pose;
  told.position_variance_mm2 = known_.told.position_variance_mm2;
  told.rotation_variance_rad2 = known_.told.rotation_variance_rad2;
  CameraPose tracker = wider(told, kLeastTracker_mm, kLeastTracker_rad);
  // Breathing that is not known is an error of the pose too.
  tracker.position_variance_mm2 += frame.respiration.deviation_mm * frame.respiration.deviation_mm;
  const CameraPose searched = wider(tracker, kSearchedShift_mm, kSearchedTurn_rad);
  // A premature beat moves the heart otherwise, and a phase that is not known puts it elsewhere in its motion.
  if (frame.phase.ectopic || frame.phase.deviation_s > kUnsurePhase_s) return;
  const ImagePhase::Together together = image.together(groups, frame, searched, model_, estimator_);
  if (!together.told) return;
  if (!known_.pivoted) known_.pivot_W_mm = together.centre_W_mm;
  known_.pivoted = true;
  known_.surface.centre_mm = together.centre_W_mm - known_.pivot_W_mm;
  known_.surface.spread_mm = std::max(together.spread_mm, 5.0);
  known_.surface.map_variance_mm2 = together.map_variance_mm2 + kLeastMap_mm * kLeastMap_mm;
  const auto& s = together.estimate;
  DisplacementEvidence evidence = displacement_evidence(
      s.s.head<kPoseUnknowns>(), s.covariance.topLeftCorner<kPoseUnknowns, kPoseUnknowns>(),
      camera_error_covariance(searched), camera_error_covariance(tracker), frame.pose.X_WC, known_.pivot_W_mm);
  // Against the map where it was learnt.
  if (displaced()) evidence.g += evidence.W * displaced_.d;
  evidence_.add(frame.stamp.capture, evidence);
  judge(frame.stamp.capture);
}

void OrganWatch::note_converged(bool some) noexcept {
  if (!some) return;
  if (!known_.unproven) known_.settling = false;
  // What was seen before was held against a map that was still moving to its place.
  if (!known_.converged) evidence_.clear();
  known_.converged = true;
}

void OrganWatch::look_for_displacement(Instant now) noexcept {
  for (std::size_t window = 0; window < CommonDisplacement::kWindows.size(); ++window) {
    const MeanDisplacement mean = evidence_.mean(window, now, known_.surface);
    if (!mean.told || mean.chi2 < (window == 0 ? kWithinABeat : 1.0) * kDoubt_chi2 || mean.size_mm < kDoubt_mm)
      continue;
    displaced_.since = now - CommonDisplacement::kWindows[window] - std::chrono::milliseconds(500);
    return;
  }
}

void OrganWatch::judge(Instant now) noexcept {
  if (!displaced() && known_.converged) look_for_displacement(now);
  if (!displaced()) known_.unproven = known_.unproven && !evidence_.mean(kProofWindow, now, known_.surface).told;
  tool_.heed_organ(!displaced() && !known_.unproven, now);
  if (!displaced()) return;
  const MeanDisplacement newest = evidence_.mean(kFollowedWindow, now, known_.surface);
  if (newest.told) {
    displaced_.d = newest.d;
    displaced_.size_mm = newest.size_mm;
  }
  const bool back = std::all_of(std::begin(kBackWindows), std::end(kBackWindows), [&](std::size_t window) {
    const MeanDisplacement mean = evidence_.mean(window, now, known_.surface);
    return mean.told && mean.size_mm < kBack_mm && mean.chi2 < kBack_chi2;
  });
  if (back) {
    settle();
    return;
  }
  look_for_rest(now);
  ask_tool(now);
  look_for_rest_with_tool(now);
}

// Whether it has moved as all that is seen, or not at all: each is a hypothesis that its movement's chi-squared is
// asked of. Where both hold a longer window is asked, and where none tells, what was told before stays.
void OrganWatch::ask_tool(Instant now) noexcept {
  for (const std::size_t window : kToolWindows) {
    const ToolMovement tool = tool_.moved(CommonDisplacement::kWindows[window], now, centre_W_mm());
    if (!tool.told) continue;
    const MeanDisplacement seen = evidence_.mean(window, now, known_.surface);
    if (!seen.told) continue;
    const bool rests = size_of(tool.d, tool.covariance, known_.surface).chi2 < kBack_chi2;
    const Vector6d apart = seen.at_centre - tool.d;
    const bool goes_with_it = size_of(apart, seen.covariance + tool.covariance, known_.surface).chi2 < kBack_chi2;
    if (rests && goes_with_it) continue;
    displaced_.cause = rests          ? DisplacedCause::kTracker
                       : goes_with_it ? DisplacedCause::kOrgan
                                      : DisplacedCause::kUnknown;
    return;
  }
}

// What the features and the tool tell together, weighted by their covariances.
void OrganWatch::look_for_rest_with_tool(Instant now) noexcept {
  displaced_.carried.reset();
  if (displaced_.cause != DisplacedCause::kOrgan) return;
  const Duration length = CommonDisplacement::kWindows[kRestWindow];
  const MeanDisplacement seen = evidence_.mean(kRestWindow, now, known_.surface);
  const MeanDisplacement lately = evidence_.mean(kFollowedWindow, now, known_.surface);
  const ToolMovement tool = tool_.moved(length, now, centre_W_mm());
  const ToolMovement tool_lately = tool_.moved(CommonDisplacement::kWindows[kFollowedWindow], now, centre_W_mm());
  if (!seen.told || !lately.told || !tool.told || !tool_lately.told) return;
  const Matrix6d of_both = seen.covariance + tool.covariance;
  if (size_of(seen.at_centre - tool.d, of_both, known_.surface).chi2 >= kBack_chi2) return;
  const double tool_deviation_mm = size_of(tool_lately.d, tool_lately.covariance, known_.surface).deviation_mm;
  const double tool_moved_mm = (tool.d - tool_lately.d).tail<3>().norm();
  const double moved_mm = (seen.at_centre - lately.at_centre).tail<3>().norm();
  if (tool_moved_mm > std::max(kToolRests_mm, tool_deviation_mm)) return;
  if (moved_mm > kRestsWithin_deviations * std::max(seen.deviation_mm, lately.deviation_mm)) return;
  const Matrix6d identity = Matrix6d::Identity();
  const Matrix6d by_seen = Matrix6d(seen.covariance + map_covariance(known_.surface)).llt().solve(identity);
  const Matrix6d by_tool = tool.covariance.llt().solve(identity);
  const Matrix6d covariance = Matrix6d(by_seen + by_tool).llt().solve(identity);
  const Vector6d d = covariance * (by_seen * seen.at_centre + by_tool * tool.d);
  const DisplacementSize size = size_of(d, covariance, known_.surface);
  displaced_.carried = {perimap::displaced(d, centre_W_mm()), size.size_mm, size.deviation_mm};
}

void OrganWatch::look_for_rest(Instant now) noexcept {
  displaced_.judged = now;
  displaced_.resting.reset();
  // Seconds that began before it was moved tell of neither place.
  if (now - *displaced_.since < CommonDisplacement::kWindows[kBeforeRestWindow] + std::chrono::seconds(1)) return;
  const MeanDisplacement rest = evidence_.mean(kRestWindow, now, known_.surface);
  if (!rest.told || rest.deviation_mm > kRest_mm) return;
  const Pose X = perimap::displaced(rest.d, known_.pivot_W_mm);
  const Vector3d centre = centre_W_mm();
  // What moves is elsewhere within a longer time, and what has begun to within a shorter one.
  for (const std::size_t window : {kBeforeRestWindow, kFollowedWindow}) {
    const MeanDisplacement other = evidence_.mean(window, now, known_.surface);
    if (!other.told) return;
    const double moved_mm = (X * centre - perimap::displaced(other.d, known_.pivot_W_mm) * centre).norm();
    if (moved_mm > kRestsWithin_deviations * std::max(rest.deviation_mm, other.deviation_mm)) return;
  }
  displaced_.resting = {X, rest.size_mm, rest.deviation_mm};
}

void OrganWatch::begin_anew() noexcept {
  settle();
  known_.unproven = true;
  known_.settling = true;
  tool_.move_home();
}

void OrganWatch::forget() noexcept {
  settle();
  tool_.forget();
  known_ = {};
}

void OrganWatch::settle() noexcept {
  displaced_ = {};
  evidence_.clear();
}

}  // namespace perimap
