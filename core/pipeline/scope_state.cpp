#include "core/pipeline/scope_state.hpp"

#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {

std::optional<ScopeState> ScopeStates::at(const TurnReading& turn, double radius_px) noexcept {
  const auto lens = scope_.lens_at(turn.rotation_rad, radius_px);
  if (!lens) return std::nullopt;
  ScopeState state;
  state.X_SC = scope_.at(turn.rotation_rad).X_SC;
  const bool of_lens = lens->focal_px.minCoeff() > 0.0;
  state.picture = pixel_map(lens_, of_lens ? lens->focal_px : Vector2d(lens_.fx, lens_.fy), lens->principal_px);
  state.rotation_rad = turn.rotation_rad;
  state.rotation_deviation_rad = turn.deviation_rad;
  constexpr double kTurned_rad = 2.0 * kDegree;
  const bool turned =
      known_ && std::abs(std::remainder(known_->rotation_rad - turn.rotation_rad, kTwoPi)) > kTurned_rad;
  const bool zoomed = known_ && std::abs(radius_px - known_->radius_px) > TurnedScope::kSameZoom * known_->radius_px;
  if (turned || zoomed) ++turns_;
  if (!known_ || turned || zoomed) known_ = Known{turn.rotation_rad, radius_px};
  return state;
}

}  // namespace perimap
