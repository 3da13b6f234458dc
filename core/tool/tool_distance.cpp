#include "core/tool/tool_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/pipeline/mesh_validity.hpp"
#include "core/pipeline/surface_maker.hpp"

namespace perimap {
namespace {

// A tracker gives ten readings in it, and a quick hand's tip goes 10 mm aside of where it was foretold; what is older
// is history.
constexpr Duration kOldestReading = std::chrono::milliseconds(100);
// The tip is a ball or an edge of some tenths of a millimetre, and a surface that is touched yields as much.
constexpr double kTouches_mm = 0.5;

DistanceAhead unknown(ToolDistanceReason reason) noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  DistanceAhead ahead;
  ahead.reason = reason;
  ahead.distance_mm = ahead.deviation_mm = ahead.rate_mm_per_s = kNone;
  ahead.point_W_mm.setConstant(kNone);
  return ahead;
}

}  // namespace

ToolDistances::ToolDistances(std::vector<WatchedTool> tools, const PoseHistorySettings& tracker, std::size_t vertices)
    : tools_(std::move(tools)), told_(tools_.size()), moved_(kToolHorizons.size(), MovedSurface(vertices)) {
  for (const WatchedTool& tool : tools_) tracks_.emplace_back(tracker, tool.tip.value_or(TipInTool{}));
}

void ToolDistances::add(const ToolSample& sample) noexcept {
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    if (tools_[i].tool == sample.tool) tracks_[i].add(sample);
  }
}

void ToolDistances::take(const std::shared_ptr<const MadeSurface>& made) {
  if (made == made_) return;
  made_ = made;
  border_ = made_ && made_->surface ? MeshBorder(made_->mesh.triangles, made_->mesh.support.size()) : MeshBorder();
}

// A surface that can be moved by the phases of this release.
bool ToolDistances::there(const SurfaceRelease& release) const noexcept {
  return made_ && made_->surface && !made_->mesh.triangles.empty() && made_->law == release.heart.law().law &&
         release.valid_time <= made_->capture + kMeshValid;
}

void ToolDistances::tell_tip(std::size_t i, Instant valid, ToolDistance& told) const noexcept {
  const TipTrack& track = tracks_[i];
  told = {};
  told.last_seen = track.last_seen();
  ToolDistanceReason reason = ToolDistanceReason::kNone;
  if (!tools_[i].tip) {
    reason = ToolDistanceReason::kNotCalibrated;
  } else if (!told.last_seen || valid - *told.last_seen > kOldestReading) {
    reason = !told.last_seen || track.lost_sight() ? ToolDistanceReason::kNotSeen : ToolDistanceReason::kTooOld;
  }
  told.tip_known = reason == ToolDistanceReason::kNone;
  if (told.tip_known) told.tip = *track.at(valid);
  told.ahead.fill(unknown(reason));
}

DistanceAhead ToolDistances::distance_of(std::size_t i, std::size_t horizon, Instant valid) const noexcept {
  const TipPrediction tip = *tracks_[i].at(valid);
  const PlaceOnSurface place = moved_[horizon].nearest(border_, tip.p_WT_mm);
  if (!place.any) return unknown(ToolDistanceReason::kNoSurface);
  if (place.on_border) return unknown(ToolDistanceReason::kBeyondEdge);
  DistanceAhead ahead;
  ahead.distance_mm = place.distance_mm;
  const double variance = place.normal_W.dot(tip.covariance_W_mm2 * place.normal_W) + place.variance_mm2;
  ahead.deviation_mm = std::sqrt(std::max(variance, 0.0));
  ahead.rate_mm_per_s = place.normal_W.dot(tip.velocity_W_mm_per_s - place.velocity_W_mm_per_s);
  ahead.point_W_mm = place.point_W_mm;
  ahead.normal_W = place.normal_W;
  return ahead;
}

std::span<const ToolDistance> ToolDistances::at(const SurfaceRelease& release,
                                                const std::shared_ptr<const MadeSurface>& made) {
  take(made);
  bool any_tip = false;
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    tell_tip(i, release.valid_time, told_[i]);
    any_tip = any_tip || told_[i].tip_known;
  }
  if (!any_tip) return told_;
  for (std::size_t h = 0; h < kToolHorizons.size(); ++h) {
    const Instant valid = release.valid_time + kToolHorizons[h];
    const PhaseEstimate phase = release.heart.at(valid);
    const bool usable_then = release.state != SurfaceState::kInvalid && usable(phase.state);
    const bool moved = usable_then && there(release);
    if (moved) moved_[h].move(made_->mesh, phase, release.breath.at(valid));
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      if (!told_[i].tip_known) continue;
      DistanceAhead& ahead = told_[i].ahead[h];
      if (!moved) {
        ahead = unknown(usable_then ? ToolDistanceReason::kNoSurface : ToolDistanceReason::kSurface);
        continue;
      }
      ahead = distance_of(i, h, valid);
      if (ahead.reason != ToolDistanceReason::kNone) continue;
      ahead.state = release.state;
      if (release.state != SurfaceState::kGood) ahead.reason = ToolDistanceReason::kSurface;
    }
  }
  for (ToolDistance& told : told_) {
    told.touches = told.ahead[0].state != SurfaceState::kInvalid && told.ahead[0].distance_mm <= kTouches_mm;
  }
  return told_;
}

}  // namespace perimap
